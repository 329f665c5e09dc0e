"""
What goes to the wheels, and who else sends commands there.

`velocity_output.VelocityOutput` decides without ROS, `command_writer.CommandWriter` sends,
`command_age_check.CommandAgeCheck` refuses what others sent too long ago. Knows `inputs`, and
nothing of trials.
"""
