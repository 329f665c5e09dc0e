"""Soon."""
def add_parser(subparsers): return subparsers.add_parser('inspection')
def run(arguments): return 0
