"""The subcommands: each module has a function ``run``. They do not know each other."""
