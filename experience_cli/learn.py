"""Soon."""
def add_parser(subparsers): return subparsers.add_parser('learn')
def run(arguments): return 0
