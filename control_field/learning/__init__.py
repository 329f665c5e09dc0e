"""
From episodes to the field: memory, composition, certificate, provenance, next starts.

`learner.Learner` is the door: a pure function from a sequence of episodes to the field. Comes in:
whoever relearns, evaluation and the figures. The controller does not: it needs no numba.
"""
