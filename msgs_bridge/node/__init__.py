"""
What every node shares: main, command line, parameters, QoS, quiet logs, and who else is there.

The one room beside the ``node.py`` files that may import rclpy.
"""
