"""
Fuzz every decoder and bag reader, guided by coverage: ``python -m benchmarks.fuzz``.

It needs `atheris` (``pip install atheris``), which is in no lock file: it weighs 35 MB and nothing
else needs it. Every target is fuzzed in a process of its own, which ends at the first error that
is not a `ValueError`, at two seconds for one input, or at more memory than it may have. What was
found to reach new code is kept in the corpus folder, and the next run begins with it.
"""

import argparse
from importlib.util import find_spec
import os
from pathlib import Path
import re
import subprocess
import sys
import tempfile
from typing import Final

from msgs_bridge.node.environment import child_environment

#: What libFuzzer may use: memory [MB], time for one input [s], length of one input [bytes].
_LIMITS: Final = ('-rss_limit_mb=1500', '-timeout=2', '-max_len=20000')
_RUNS: Final = re.compile(r'Done (\d+) runs')
_COVERAGE: Final = re.compile(r'cov: (\d+) ft: (\d+) corp: (\d+)')


def fuzz(name: str, flags: list[str]) -> None:
    """Fuzz one target in this process, which does not return from it."""
    import atheris
    import rclpy  # noqa: F401 - it starts the interpreter anew when it comes first
    with atheris.instrument_imports(include=['msgs_bridge', 'mcap']):
        from benchmarks.fuzz_targets import targets
    target = targets()[name]
    atheris.Setup([sys.argv[0], *flags], target)
    atheris.Fuzz()


def run_target(name: str, seeds: tuple[bytes, ...], folder: Path, seconds: int) -> tuple[int, str]:
    """Fuzz one target in a process of its own; return its exit code and what it said."""
    corpus = folder / name
    corpus.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(seeds):
        (corpus / f'seed_{number}').write_bytes(seed)
    command = [sys.executable, '-m', 'benchmarks.fuzz', '--child', name, '--', *_LIMITS,
               f'-max_total_time={seconds}', f'-artifact_prefix={folder}/{name}_found_',
               str(corpus)]
    done = subprocess.run(command, env=child_environment(), stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE, text=True, errors='replace', check=False)
    (folder / f'{name}.log').write_text(done.stderr)
    return done.returncode, done.stderr


def _summary(text: str) -> str:
    runs, coverage = _RUNS.search(text), _COVERAGE.findall(text)
    edges, _, corpus = coverage[-1] if coverage else ('?', '?', '?')
    return f'{runs[1] if runs else "?":>9} runs, {edges:>5} edges, {corpus:>4} inputs kept'


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('targets', nargs='*', help='all of them by default')
    parser.add_argument('--seconds', type=int, default=60, help='for each target (%(default)s)')
    parser.add_argument('--corpus', type=Path, metavar='FOLDER', default=Path(
        tempfile.gettempdir()) / 'experience_controller_fuzz', help='(%(default)s)')
    return parser.parse_args()


def main() -> int:
    """Fuzz the targets one after the other; return 1 if something was found."""
    arguments = _arguments()
    if find_spec('atheris') is None:
        print('fuzz: atheris is not installed: pip install atheris', file=sys.stderr)
        return 2
    from benchmarks.fuzz_targets import targets
    known = targets()
    wrong = [name for name in arguments.targets if name not in known]
    if wrong:
        print(f'fuzz: {wrong[0]} is no target, must be one of {", ".join(known)}', file=sys.stderr)
        return 2
    n_found = 0
    for name in arguments.targets or known:
        code, text = run_target(name, known[name].seeds, arguments.corpus, arguments.seconds)
        n_found += code != 0
        print(f'{name:15} {_summary(text)}', 'ok' if code == 0 else
              f'FOUND something, see {arguments.corpus / name}.log', flush=True)
    return 1 if n_found else 0


if __name__ == '__main__':
    if sys.argv[1:2] == ['--child']:
        os.environ.setdefault('PYTHONHASHSEED', '0')
        fuzz(sys.argv[2], sys.argv[4:])
    sys.exit(main())
