"""
The learner: records, learns between trials, publishes the field.

`session.Session` decides, without ROS: what is recorded, which trial comes next. `node` has the
topics and services, `recorder` writes bags, `learning_loop` learns from them in a thread aside and
publishes the field. `settings` and `reports` are used by the command line, too.
"""
