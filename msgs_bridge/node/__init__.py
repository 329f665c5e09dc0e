"""
What every node shares: main, command line, parameters, QoS, quiet logs, and who else is there.

`run.run_node` is the door. With the ``node.py`` files the only place that imports rclpy.
"""
