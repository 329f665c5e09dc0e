"""
The robot's memory: a folder a task, a bag an episode, and what they teach, in order.

`task_folder.TaskFolder` names and numbers bags, `episode.Episode` is one, opened once, and
`relearn.Relearner` folds them into the field; beside them everything that changes a bag and can be
undone. `rosbag2` below knows files and records but no episodes, `external` reads bags that others
recorded. Comes in: the learner and the command line.
"""
