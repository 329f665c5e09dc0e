"""
What may be learnt from a drive: poses in, the cells of a demonstration or a refusal out.

Whether a robot can have driven what its poses say, where it left the workspace, which loops are
cut out. Used by whoever reads bags, and live by the learner.
"""
