"""The node that brings odometry into the frame of a map."""
