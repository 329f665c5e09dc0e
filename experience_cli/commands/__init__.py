"""The subcommands: each module has ``add_parser`` and ``run``; `main` lists them."""
