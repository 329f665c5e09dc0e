"""
The format: MCAP, sqlite3 and ROS 1 files, metadata.yaml, the columns of their messages.

Knows no task and no episode. `any_reader.open_bag` opens any bag, whoever recorded it;
`reader.BagReader` reads one MCAP file as we write it, and `writer.BagWriter` writes one.
"""
