"""The paper in NumPy: prototypes, control field, Q-learning, certificate. No ROS, no files."""
