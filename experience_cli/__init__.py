"""The command line `experience`: a module a command, listed in `main.COMMANDS`."""
