"""
Drives that other recorders recorded: which topic is what, poses in one frame, taken over.

`drive.open_drive` is the door; `take_over` makes a bag of our own of it. Comes in: the command
line.
"""
