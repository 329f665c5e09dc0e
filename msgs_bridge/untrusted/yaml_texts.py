"""
Reading YAML that is not ours, within bounds, and writing YAML.

Ten lines of YAML can stand for more than memory holds, and a few kilobytes of brackets break a
parser: a text is checked before any of its values is made.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from msgs_bridge.untrusted.files import MOST_BYTES

#: How deep lists may be nested, how many entries there may be, and how long a word may be that is
#: not quoted (numbers are such words).
_MOST_DEPTH, _MOST_EVENTS, _MOST_WORD = 50, 500_000, 4096


class BoundlessYamlError(ValueError):
    """A text in YAML that may stand for more than memory holds; the message is one line."""


def yaml_from_text(text: str | bytes, as_written: bool = False) -> Any:
    """
    Return a text in YAML as plain types.

    Parameters
    ----------
    text : str or bytes
        At most `MOST_BYTES` long.
    as_written : bool
        Whether numbers and words stay texts, and a key given twice is refused: other parsers, such
        as yaml-cpp, read 010 and a second value in their own way.

    Raises
    ------
    BoundlessYamlError
        If it is nested too deeply, or has aliases (``*name``) or merge keys (``<<``): a few lines
        of those can stand for more than memory holds.
    ValueError
        If it is no YAML, or a key is given twice. All are one line, without the file.

    """
    with _yaml_loader(text, as_written) as loader:
        node = loader.get_single_node()
        if as_written:
            _check_keys(node)
        return None if node is None else loader.construct_document(node)


def yaml_node(text: str) -> Any:
    """Return a text in YAML as nodes of PyYAML, which know their places; see `yaml_from_text`."""
    with _yaml_loader(text) as loader:
        return loader.get_single_node()


def text_from_yaml(value: Any) -> str:
    """Return plain types as YAML in their order, without aliases, laid out as by yaml-cpp."""
    import yaml

    class Plain(yaml.SafeDumper):  # type: ignore[misc, unused-ignore]
        def ignore_aliases(self, data: object) -> bool:
            return True

        def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
            super().increase_indent(flow, False)

    Plain.add_representer(str, lambda dumper, text: dumper.represent_scalar(
        'tag:yaml.org,2002:str', text, None if text else '"'))
    Plain.add_representer(type(None), lambda dumper, _: dumper.represent_scalar(
        'tag:yaml.org,2002:null', '~'))
    return str(yaml.dump(value, Dumper=Plain, sort_keys=False, width=2**30))


@contextmanager
def _yaml_loader(text: str | bytes, as_written: bool = False) -> Iterator[Any]:
    """Check a text in YAML and yield its loader, whose errors become ValueError."""
    import yaml  # type: ignore[import-untyped, unused-ignore]

    if len(text) > MOST_BYTES:
        raise BoundlessYamlError(
            f'it has {len(text)} bytes, YAML of this kind has at most {MOST_BYTES}')
    # In C 20 times as fast; without a bound of the depth it would crash.
    name = 'BaseLoader' if as_written else 'SafeLoader'
    kind = getattr(yaml, f'C{name}', getattr(yaml, name))
    try:
        _check_events(yaml, yaml.parse(text, kind))
        loader = kind(text)
        try:
            yield loader
        finally:
            loader.dispose()
    except yaml.YAMLError as error:
        mark = getattr(error, 'problem_mark', None)
        raise ValueError(f'it is no YAML{_line(mark)}') from None
    except (RecursionError, OverflowError):
        raise ValueError('it is no YAML') from None


def _check_keys(node: Any) -> None:
    """Refuse mappings with a key given twice; the depth was checked before."""
    lines: dict[str, int] = {}
    for child in [] if isinstance(getattr(node, 'value', ''), str) else node.value:
        key, value = child if isinstance(child, tuple) else (None, child)
        if key is not None and isinstance(key.value, str):
            line = int(key.start_mark.line) + 1
            if key.value in lines:
                raise ValueError(f'it says {key.value!r} twice, in line {lines[key.value]} and in '
                                 f'line {line}: keep one of them')
            lines[key.value] = line
        _check_keys(value)


def _check_events(yaml: Any, events: Any) -> None:
    """Refuse what would be too much for a loader, before any value is made."""
    depth = 0
    for number, event in enumerate(events):
        if isinstance(event, yaml.AliasEvent):
            raise BoundlessYamlError(
                f'it has an alias (*{event.anchor}){_line(event.start_mark)}, which is not '
                f'followed: write out what it stands for')
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _MOST_DEPTH or number > _MOST_EVENTS:
            raise BoundlessYamlError(
                f'it has more than {_MOST_DEPTH} levels or {_MOST_EVENTS} entries')
        if isinstance(event, yaml.ScalarEvent):
            _check_word(event)


def _check_word(event: Any) -> None:
    is_plain = event.implicit[0] or event.tag
    if is_plain and event.value == '<<':
        raise BoundlessYamlError(
            f'it has a merge key (<<){_line(event.start_mark)}, which is not followed: write out '
            f'what it stands for')
    if is_plain and len(event.value) > _MOST_WORD:
        raise BoundlessYamlError(
            f'it has a word of {len(event.value)} letters{_line(event.start_mark)}')


def _line(mark: Any) -> str:
    return f' in line {mark.line + 1}' if mark is not None else ''
