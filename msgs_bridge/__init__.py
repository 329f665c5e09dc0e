"""ROS messages and MCAP records from and to the core's types."""
