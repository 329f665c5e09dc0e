"""Soon."""
def add_parser(subparsers): return subparsers.add_parser('repair')
def run(arguments): return 0
