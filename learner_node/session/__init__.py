"""
What the learner is at, without ROS: a demonstration, a series of trials, learning.

`session.Session` is the door: it is told what arrives, and answers with outputs. Knows no other
room.
"""
