"""
How good is what is learnt, on any world: worlds, teachers, metrics, methods. No ROS in here.

`experiment.run_seed` is the door; ``experience evaluate`` and the benchmarks come in.
"""
