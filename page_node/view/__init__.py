"""
What the page shows: messages become frames, and the situation a code for what to do next.

`live_view.LiveView` is told what arrives and puts frames where viewers get them; `advice` says in
codes what goes on, which the page has words for in every language. Nothing here knows sockets, or
rclpy.
"""
