"""
Who drives: a trial, decision by decision, or a person.

`trial_control.TrialControl` and `manual_control.ManualControl` are the doors. Comes in: the
supervisor.
"""
