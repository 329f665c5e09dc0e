"""
Drives that other recorders recorded: which topic is what, poses in one frame, taken over.

`drive.open_drive` is the door; `import_drive` makes a bag of our own of it. Comes in: the
command line.
"""
