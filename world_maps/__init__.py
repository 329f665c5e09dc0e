"""
Maps from files: worlds of our own, map_server's and MovingAI's.

`world.load_world` is the door; every reader raises `errors.WorldError`, one line. Comes in: the
simulator, the evaluation and the command line.
"""
