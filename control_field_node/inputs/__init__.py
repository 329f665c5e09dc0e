"""
What the controller is told, and whether that counts: poses, local grids, fields, heartbeats.

`sensing.Sensing` and `active_field.ActiveField` are the doors. Come in: the supervisor, `driving`
and `commands`.
"""
