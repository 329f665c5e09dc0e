"""
Teaching by driving: keys and services that drive, record, keep, redo and try.

`msgs_bridge.teaching` says what each action does, `driving` which command the keys stand for, both
without ROS; `keyboard`, `screen` and `terminal` are the person's side. Nobody comes in but who
starts the node.
"""
