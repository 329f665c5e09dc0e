"""
The learner: records, learns between trials, publishes the field.

`session.Session` decides, without ROS: what is recorded, which trial comes next. `node` has the
topics and services, `recorder` writes bags, `task_memory` learns from them in a thread of
`background_worker`. `settings` and `reports` are used by the command line, too.
"""
