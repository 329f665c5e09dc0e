"""
A page to drive, teach and watch the robot from, in any browser.

`server` is what browsers talk to and the only place that knows of sockets; `driving` is the
dead-man and says who drives; `exchange` is what the rooms answer requests with. None of them
knows ROS: that is `node`. Why it is cut like this: ADR 44; who gets in: the page on security.
"""
