"""The command line `experience`: a module a command, listed in `main.COMMANDS`."""

import experience_cli.quiet_start  # noqa: F401 - Ctrl-C is heard before anything heavy is there
