"""
How good is what is learnt, on any world? Worlds, teachers, metrics and methods, without ROS.

`experiment` runs one seed, `workers` many of them, `report` makes medians of them, `field_file`
writes what was learnt; `methods.registry` names the methods. Comes in, by these and by what an
experiment is made of (`worlds`, `starts`, `teachers`): ``experience evaluate`` and the benchmarks.
"""
