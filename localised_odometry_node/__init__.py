"""
Odometry in the frame of a map, from the wheels' odometry and the poses of a localisation.

`fusion.LocalisedOdometry` makes it, without ROS. Nobody comes in but who starts the node.
"""
