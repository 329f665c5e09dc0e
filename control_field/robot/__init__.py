"""
What runs on the robot: policy, steering, collision monitor, stop rules, particle filter.

Functions and small objects that get time and poses passed in. They know nothing of learning. Comes
in: the nodes, above all the controller, and `learning` for the rules of a step.
"""
