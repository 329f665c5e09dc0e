"""The command line: demo, learn, evaluate, inspect, repair."""
