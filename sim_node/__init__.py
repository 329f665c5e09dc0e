"""
A simulated robot in its world.

`simulation.Simulation` is the robot without ROS: commands in, ticks on, what it senses out; `node`
puts it on the topics of a real one. Comes in: who starts the node, and the benchmarks.
"""
