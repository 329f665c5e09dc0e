"""
Maps from files: worlds of our own, map_server's and MovingAI's.

Comes in: the simulator and the evaluation. Every reader raises `errors.WorldError`, one line.
"""
