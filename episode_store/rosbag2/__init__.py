"""
The format: MCAP and sqlite3 files, metadata.yaml, the columns of their messages.

Knows no task and no episode. `any_reader.open_bag` opens whatever lies there.
"""
