"""
What may be learnt from a drive: poses in, the cells of a demonstration or a refusal out.

`demonstration` is the door; the rest judges: whether a robot can have driven so, where it left the
workspace, which loops to cut out. Comes in: whoever reads bags, and the learner while somebody
drives.
"""
