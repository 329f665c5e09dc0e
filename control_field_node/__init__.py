"""
The controller: follows the control field from cell to cell and publishes what it decides.

`supervisor.Supervisor` is the door to what it does without ROS: it is told what arrives, with the
time, and answers with a velocity and decisions. What counts of that is in `inputs`, what goes to
the wheels in `commands`, who drives in `driving`. `node` has the topics, `publishers` writes the
messages. Needs rclpy and NumPy only; nobody comes in but who starts the node.
"""
