"""
Worlds of a simulation, drawn and brought along, and tasks to teach in them.

`world_files` reads and writes them in the working process, `changer` lets simulator and learner
have another one, `endpoints` is the door. Nothing here knows sockets, or rclpy.
"""
