"""A page to drive, teach and watch the robot from, in any browser."""
