"""
What is learnt of a closed bag, in a thread aside.

`learning_loop.LearningLoop` is the door; `task_memory.TaskMemory` holds bags and field of a task.
"""
