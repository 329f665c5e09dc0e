"""
Teaching by driving: keys and services that drive, record, keep, redo and try.

`teaching.Teaching` says what each action does, `driving` which command the keys stand for, both
without ROS; `keyboard`, `screen` and `terminal` are the person's side, `service_clients` the
robot's. Nobody comes in but who starts the node.
"""
