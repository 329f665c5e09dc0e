"""
The local grid of a real robot, from a laser's scans or a costmap.

`neighbourhood.NeighbourhoodMaker` makes it, without ROS; `laser_mount_finder` reads where the
laser is mounted. Nobody comes in but who starts the node.
"""
