"""
Hold what is written about the code to the code.

In the pages of `doc/`, in README.md and CONTRIBUTING.md, and in the docstrings of the packages,
every file, module and function that stands in backticks has to exist (in a package's docstring a
name in single backticks is a module, seen from there), and every link has to lead
somewhere; a walk of `doc/architecture.md` has as many files and stops as its title says; no
identifier in the code uses a word that `doc/glossary.md` has replaced; and the arguments that a
docstring describes are those that there are.
"""

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import chain
from pathlib import Path
import re
import sys

ROOT = Path(__file__).resolve().parent.parent
ROOMS = frozenset(path.parent.name for path in ROOT.glob('*/__init__.py'))
#: Top folders whose files may be named; `bags/` and `out/` hold what users make.
FOLDERS = ROOMS | {'config', 'doc', 'launch', 'test', 'tools'}
GLOSSARY = ROOT / 'doc' / 'glossary.md'
REPLACED = '## Words that are not used any more'
_FENCE = re.compile(r'^```.*?^```', re.MULTILINE | re.DOTALL)
_QUOTED = re.compile(r'(?<!`)`([^`\n]+)`(?!`)')
_LINK = re.compile(r'\]\(([^)\s#]+)(?:#[^)]*)?\)')
_FILE = re.compile(r'([\w./-]+\.py)(?::([\w.]+))?')
_PATH = re.compile(r'[\w.-]+(?:/[\w.-]*)+')
_DOTTED = re.compile(r'[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+')
_WALK = re.compile(r'^### .*\((\d+) files, (\d+) stops\)$', re.MULTILINE)
_STOP = re.compile(r'^\| \d+ \| `([\w./-]+\.py):[\w.]+`', re.MULTILINE)
_PARAMETERS = re.compile(
    r'^Parameters\n-+\n(.*?)(?=^\w+\n-+\n|\Z)', re.MULTILINE | re.DOTALL)
_WORD = re.compile(r'[A-Z]?[a-z]+|[A-Z]+(?![a-z])')


def pages() -> Iterator[tuple[str, str]]:
    """Yield name and text of every page, and of every package's docstring."""
    for path in (*ROOT.glob('*.md'), *ROOT.glob('doc/**/*.md'), ROOT / 'bags' / 'README.md'):
        yield str(path.relative_to(ROOT)), _FENCE.sub('', path.read_text())
    for room in sorted(ROOMS):
        for path in sorted((ROOT / room).rglob('__init__.py')):
            text = ast.get_docstring(ast.parse(path.read_text())) or ''
            yield str(path.relative_to(ROOT)), text


def wrong_names(page: str, text: str) -> Iterator[str]:
    """Yield what a page names in backticks, or links to, and is not there."""
    package = page.split('/')[:-1] if page.endswith('__init__.py') else None
    for name in _QUOTED.findall(text):
        if not is_there(name) or (package and not _is_near(name, package)):
            yield f'{page}: `{name}` is not there'
    for target in _LINK.findall(text):
        if '://' not in target and not (ROOT / page).parent.joinpath(target).exists():
            yield f'{page}: the link to {target} leads nowhere'


def is_there(name: str) -> bool:
    """Return False if a quoted text names a file, a module or a function that does not exist."""
    if found := _FILE.fullmatch(name):
        path, symbol = found.groups()
        files = [ROOT / path] if '/' in path else [ROOT / path, *_files_called(path)]
        return any(file.is_file() and (not symbol or _has(file, symbol)) for file in files)
    if _PATH.fullmatch(name) and name.split('/')[0] in FOLDERS:
        path = name.rstrip('/')
        return (ROOT / path).exists() or any(ROOT.glob(f'{path}-*.md'))
    if _DOTTED.fullmatch(name) and name.split('.')[0] in ROOMS:
        return _resolves(name)
    return True


def _is_near(name: str, package: list[str]) -> bool:
    """Return True if the docstring of a package may name this: a module seen from there."""
    return any(_resolves('.'.join([*package[:n], name])) for n in range(len(package), -1, -1))


def _resolves(dotted: str) -> bool:
    """Return True if a dotted name is a package, a module, or something in one."""
    path, parts = ROOT, dotted.split('.')
    while parts and (path / parts[0]).is_dir():
        path /= parts.pop(0)
    if not parts:
        return True
    module = path / f'{parts[0]}.py'
    symbol = '.'.join(parts[1:])
    return module.is_file() and (not symbol or _has(module, symbol))


@cache
def _files_called(name: str) -> tuple[Path, ...]:
    return tuple(chain.from_iterable((ROOT / top).rglob(name) for top in sorted(FOLDERS)))


def _has(path: Path, symbol: str) -> bool:
    return symbol in _symbols(path)


@cache
def _symbols(path: Path) -> frozenset[str]:
    """Return what a module defines: functions, classes, their methods and attributes, names."""
    return frozenset(_defined(_tree(path).body, ''))


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


def _defined(body: list[ast.stmt], prefix: str) -> Iterator[str]:
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield prefix + node.name
        if isinstance(node, ast.ClassDef):
            yield from _defined(node.body, f'{prefix}{node.name}.')
        targets = node.targets if isinstance(node, ast.Assign) else \
            [node.target] if isinstance(node, ast.AnnAssign) else []
        yield from (prefix + target.id for target in targets if isinstance(target, ast.Name))


def miscounted_walks(text: str) -> Iterator[str]:
    """Yield the walks of the page on architecture whose titles do not count what they list."""
    for section in re.split(r'^(?=### )', text, flags=re.MULTILINE):
        if title := _WALK.match(section):
            files = _STOP.findall(section)
            counted = (str(len(set(files))), str(len(files)))
            if counted != title.groups():
                yield 'doc/architecture.md: "{}" has {} files, {} stops'.format(
                    title.group(0), *counted)


def replaced_words(glossary: str) -> dict[str, str]:
    """Return the words that the glossary has replaced, each with the word to use."""
    _, _, section = glossary.partition(REPLACED)
    rows = (line.strip('| ').split(' | ') for line in section.splitlines() if
            line.startswith('| `'))
    return {word: use for words, use, *_ in rows for word in _QUOTED.findall(words)}


def kept_names(glossary: str) -> frozenset[str]:
    """Return the names that keep a replaced word, as users have them in files."""
    _, _, section = glossary.partition(REPLACED)
    return frozenset(_QUOTED.findall(section.partition('\nKept')[2]))


def old_words(path: Path, replaced: dict[str, str], kept: frozenset[str]) -> Iterator[str]:
    """Yield the identifiers of a file that use a replaced word."""
    for node in ast.walk(_tree(path)):
        for name in set(_identifiers(node)) - kept:
            for word in {part.lower() for part in _WORD.findall(name)} & replaced.keys():
                yield (f'{path.relative_to(ROOT)}:{getattr(node, "lineno", 1)}: {name}: '
                       f'say {replaced[word]} instead of {word}')


def wrong_arguments(path: Path) -> Iterator[str]:
    """Yield the arguments that a docstring describes and that there are not."""
    for node in ast.walk(_tree(path)):
        if not isinstance(node, ast.FunctionDef | ast.ClassDef):
            continue
        if found := _PARAMETERS.search(ast.get_docstring(node) or ''):
            rows = re.findall(r'^(\w.*?)(?: :|$)', found.group(1), re.MULTILINE)
            said = {name.strip(' *`') for row in rows for name in row.split(',')}
            for name in sorted(said - _arguments(node)):
                yield f'{path.relative_to(ROOT)}:{node.lineno}: {node.name} has no argument {name}'


def _arguments(node: ast.FunctionDef | ast.ClassDef) -> set[str]:
    """Return what a function takes, or what a class takes: its fields, or those of `__init__`."""
    if isinstance(node, ast.FunctionDef):
        return {each.arg for each in ast.walk(node.args) if isinstance(each, ast.arg)}
    found = {each.target.id for each in node.body
             if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name)}
    return found.union(*(_arguments(each) for each in node.body
                         if isinstance(each, ast.FunctionDef) and each.name == '__init__'))


def _identifiers(node: ast.AST) -> list[str]:
    """Return what a node of a syntax tree defines: what it merely uses is said where it is."""
    match node:
        case ast.FunctionDef() | ast.ClassDef():
            # A test's name is a sentence.
            return [] if node.name.startswith('test_') else [node.name]
        case ast.arg():
            return [node.arg]
        case ast.Name(ctx=ast.Store()):
            return [node.id]
        case ast.Attribute(ctx=ast.Store()):
            return [node.attr]
    return []


def problems() -> Iterable[str]:
    """Yield all that is wrong, a line each."""
    for page, text in pages():
        yield from wrong_names(page, text)
    yield from miscounted_walks((ROOT / 'doc' / 'architecture.md').read_text())
    glossary = GLOSSARY.read_text()
    replaced, kept = replaced_words(glossary), kept_names(glossary)
    for folder in sorted(ROOMS | {'launch', 'test', 'tools'}):
        for path in sorted((ROOT / folder).rglob('*.py')):
            yield from old_words(path, replaced, kept)
            yield from wrong_arguments(path)


def main() -> int:
    """Print the problems; return 1 if there are any."""
    found = list(dict.fromkeys(problems()))
    print('\n'.join(found) or 'What is written about the code is true.')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
