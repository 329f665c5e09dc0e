"""
How good is what is learnt, on any world? Worlds, teachers, metrics and methods, without ROS.

`experiment` runs one seed, `workers` many of them, `report` makes medians of them. Comes in:
``experience evaluate`` and the benchmarks.
"""
