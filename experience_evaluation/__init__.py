"""Judging what was learnt on worlds from elsewhere; no ROS in here."""
