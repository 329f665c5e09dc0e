"""
The method in NumPy: prototypes, control field, Q-learning, certificate.

No ROS, no files, no clock in here; everybody may import it. On top lie the words that all
packages share (`grid`, `headings`, `records`, `parameters`, `poses`, `local_grid`, `words`).
`kernels` holds the loops, `drives` says what may be learnt from a drive, `robot` runs on the
robot, and `learning` turns episodes into a field.
"""
