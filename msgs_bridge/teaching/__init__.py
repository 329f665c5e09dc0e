"""
What whoever lets a person teach needs, keys and page alike: the actions and what is known.

`teaching.Teaching` says what each action does, `service_clients` asks learner and controller for
it, `robot_placement` sets a simulated robot somewhere, `status_tracker` knows how things stand.
"""
