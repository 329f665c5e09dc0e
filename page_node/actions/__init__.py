"""
What the buttons of the page ask for over HTTP: checked, then done as keys do it.

`wanted` reads a request, `page_teaching` carries it out, `api` is the door. Nothing here knows
sockets, or rclpy.
"""
