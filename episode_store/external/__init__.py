"""Drives that other recorders recorded: which topic is what, poses in one frame, taken over."""
