"""
What buttons of the page do: `POST /api/actions/{action}`, checked, then done as keys do it.

`wanted` reads a request, `page_teaching` carries it out, `api` is the door. Nothing here knows
sockets, or rclpy.
"""
