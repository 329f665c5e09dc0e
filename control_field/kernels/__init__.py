"""
The loops of the method, written once for two executions.

Plain Python for the robot, which has no numba, and compiled (`compiled`) for the learner: the
same source, the same bits. Imported by `robot` and `learning`; only the latter imports `compiled`.
"""
