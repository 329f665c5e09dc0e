"""The node that makes a 3x3 neighbourhood of a laser's scans or a costmap."""
