"""
What runs on the robot: policy, steering, collision monitor, stop rules, particle filter.

Functions and small objects that get time and messages passed in; `control_field_node` gives them
theirs. They know nothing of learning.
"""
