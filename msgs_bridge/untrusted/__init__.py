"""
The one door to what is not ours: files are opened with care, text is escaped.

The lowest package of the bridge: it knows neither messages nor nodes, and everybody may come in.
"""
