"""
Maps from files: worlds of our own, map_server's and MovingAI's, and what happens in them.

`world.load_world` and `movers_file.load_movers` are the doors; every reader raises
`errors.WorldError`, one line. Comes in: the simulator, the evaluation and the command line.
"""
