"""What browsers talk to: routes, sockets, files, and the guard before all of them."""
