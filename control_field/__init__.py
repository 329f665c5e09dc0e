"""
The paper in NumPy: prototypes, control field, Q-learning, certificate.

No ROS, no files, no clock in here; everybody may import it. On top lie the words that all
rooms share (`grid`, `headings`, `records`, `parameters`, `poses`, `local_grid`); `kernels` holds
the loops, `drives` what may be learnt from a drive, `robot` what runs on the robot, and
`learning` what turns episodes into a field.
"""
