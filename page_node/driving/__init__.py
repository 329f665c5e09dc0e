"""Who drives, and for how long: the dead-man, without ROS and without sockets."""
