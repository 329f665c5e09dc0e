"""What our nodes need to know of a robot, read from its URDF and its parameter files."""
