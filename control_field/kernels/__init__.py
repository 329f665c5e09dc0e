"""
The loops of the method, written once for two executions.

In plain Python for the robot, which has no numba, and compiled (`compiled`) for the learner: the
same source, the same bits. Comes in: `robot`, and `learning`, evaluation and figures, which alone
import `compiled`.
"""
