"""
The format: MCAP, sqlite3 and ROS 1 files, metadata.yaml, the columns of their messages.

`any_reader.open_bag` opens any bag, `reader.BagReader` one MCAP file as we write it, and
`writer.BagWriter` writes. Knows no task and no episode; comes in: the rest of `episode_store`.
"""
