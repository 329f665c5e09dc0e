"""
Messages from and to the core's types: free functions ``x_from_y``, no node, no clock.

`cdr` reads the bytes of a message where rclpy would be too slow or is not there. Comes in: nodes
and bags.
"""
