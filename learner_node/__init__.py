"""
The learner: records, learns between trials, publishes the field.

`session.session.Session` decides, without ROS: what is recorded, which trial comes next. `node`
has the topics and services, `recording` writes bags, `learning` learns from them in a thread aside
and publishes the field. `settings` and `reports` are used by the command line, too.
"""
