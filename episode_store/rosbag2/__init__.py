"""
The format: MCAP and sqlite3 files, metadata.yaml, the columns of their messages.

`any_reader.open_bag` opens whatever lies there, `writer.BagWriter` writes. Knows no task and no
episode; comes in: the rest of `episode_store`.
"""
