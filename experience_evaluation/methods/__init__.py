"""The methods under comparison, behind one protocol (`method.Method`), by name in `registry`."""
