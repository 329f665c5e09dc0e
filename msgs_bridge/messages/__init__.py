"""Messages from and to the core's types: free functions ``x_from_y``, no node, no clock."""
