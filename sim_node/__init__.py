"""A simulated robot in its world: ROS-free modules and the node `sim_node`."""
