"""
Columns of the numbers in many messages, at the speed of memory.

Messages of one topic mostly have one layout: the same frames, the same lengths. One message is
parsed; in all others whose shaping bytes equal its own the numbers lie in the same places, and
are copied as columns. The rest is grouped again, in the end message by message: the result is
always that of parsing each message.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from episode_store.rosbag2.reader import RawMessages
from msgs_bridge.messages.cdr import CdrError, DESCRIBED, Fields, Layout, layout_from_cdr

#: Layouts that are searched for among all messages; messages with none of them are parsed singly.
MAX_LAYOUTS: Final = 16


@dataclass
class Columns:
    """
    The numbers of many messages.

    Parameters
    ----------
    values : dict of str to ndarray, shape (n,) or (n, k)
        By the name of the field; 0 in the rows that were refused.
    layout : ndarray of int32, shape (n,)
        Index into ``layouts``; -1 for a refused message.
    layouts : list of Layout
        With the texts of the rows.
    refusal : str
        Why the first refused message was refused; empty if none was.
    other_frame : str
        The frame that it is in, if that is why.

    """

    values: dict[str, npt.NDArray[Any]]
    layout: npt.NDArray[np.int32]
    layouts: list[Layout] = field(default_factory=list)
    refusal: str = ''
    other_frame: str = ''

    @property
    def accepted(self) -> npt.NDArray[np.bool_]:
        """Return a mask of the messages that were read, shape (n,)."""
        return np.asarray(self.layout >= 0)

    def texts(self, name: str) -> list[str]:
        """Return a text's value for each layout."""
        return [layout.values[name] for layout in self.layouts]

    def refuse(self, rows: npt.NDArray[np.int64], reason: str) -> None:
        """Refuse rows by index; the first reason is kept."""
        if len(rows):
            self.layout[rows] = -1
            self.refusal = self.refusal or reason


def read_columns(messages: RawMessages, names: Mapping[str, int]) -> Columns:
    """
    Read fields of all messages of a topic.

    Parameters
    ----------
    messages : RawMessages
        Of a type in `cdr.DESCRIBED`.
    names : mapping of str to int
        Fields, and how many numbers each must have.

    Returns
    -------
    Columns
        A message that cannot be read is refused, not an error.

    Raises
    ------
    CdrError
        If the type is not described.

    """
    fields = DESCRIBED.get(messages.type_name)
    if fields is None:
        raise CdrError(f'{messages.topic} is {messages.type_name or "not there"}, must be one of '
                       f'{", ".join(sorted(DESCRIBED))}')
    columns = Columns(_empty_columns(fields, names, len(messages)),
                      np.full(len(messages), -1, dtype=np.int32))
    for group in groups(messages, fields, columns, names):
        wrong = [name for name, n in names.items() if group.layout.places[name].n != n]
        if wrong:
            columns.refuse(group.rows, f'{messages.topic}: {wrong[0]} has '
                           f'{group.layout.places[wrong[0]].n} numbers, '
                           f'must have {names[wrong[0]]}')
            continue
        # A slice is several times as fast as indices, and nearly always all are alike.
        rows = slice(None) if len(group.rows) == len(messages) else group.rows
        for name in names:
            columns.values[name][rows] = group.numbers(name)
    return columns


@dataclass
class Group:
    """
    Messages of one layout.

    Parameters
    ----------
    layout : Layout
        Of all of them.
    rows : ndarray of int64, shape (n,)
        Which ones.
    heads : ndarray of uint8, shape (n, k)
        Their first bytes, up to the last of interest.

    """

    layout: Layout
    rows: npt.NDArray[np.int64]
    heads: npt.NDArray[np.uint8]

    def numbers(self, name: str) -> npt.NDArray[Any]:
        """Return a field's numbers, shape (n,) or (n, k)."""
        place = self.layout.places[name]
        scalar = np.dtype(self.layout.order + place.scalar)
        numbers: npt.NDArray[Any] = np.ndarray(
            (len(self.rows), place.n), scalar, self.heads, place.offset,
            (self.heads.shape[1], scalar.itemsize))
        return numbers[:, 0] if place.n == 1 else numbers


def groups(
    messages: RawMessages, fields: Fields, columns: Columns, names: Iterable[str],
) -> Iterator[Group]:
    """
    Yield the messages of each layout; ``columns.layout`` is filled in on the way.

    Parameters
    ----------
    messages : RawMessages
    fields : Fields
        What they are made of.
    columns : Columns
        Takes layouts and refusals.
    names : iterable of str
        Fields whose bytes are wanted.

    """
    rest = np.arange(len(messages))
    while len(rest):
        try:
            layout = layout_from_cdr(fields, messages[int(rest[0])])
        except CdrError as error:
            columns.refusal = columns.refusal or f'{messages.topic}: {error}'
            rest = rest[1:]
            continue
        alone = len(columns.layouts) >= MAX_LAYOUTS
        group = _alike(messages, layout, rest[:1] if alone else rest, names)
        columns.layout[group.rows] = len(columns.layouts)
        columns.layouts.append(layout)
        rest = rest[columns.layout[rest] < 0]
        yield group


def _alike(
    messages: RawMessages, layout: Layout, rows: npt.NDArray[np.int64], names: Iterable[str],
) -> Group:
    """Find the messages with the layout of the first one, and fetch their bytes."""
    rows = rows[messages.sizes[rows] == messages.sizes[rows[0]]]
    shaping = np.zeros(layout.size, dtype=np.bool_)
    for start, end in [(0, 2), *layout.frozen]:
        shaping[start:end] = True
    places = [layout.places[name] for name in names]
    ends = [place.offset + int(place.scalar[-1]) * place.n for place in places]
    heads = messages.bytes_at(rows, 0, max(int(np.flatnonzero(shaping)[-1]) + 1, *ends, 0))
    shape = heads[:, shaping[:heads.shape[1]]]
    equal = (shape == shape[:1]).all(axis=1)
    return Group(layout, rows[equal], heads if equal.all() else heads[equal])


def _empty_columns(
    fields: Fields, names: Mapping[str, int], n_rows: int,
) -> dict[str, npt.NDArray[Any]]:
    codes = {name: str(code).rstrip('!').partition('*')[0].removesuffix('[]')
             for name, code in fields}
    return {name: np.zeros((n_rows, n) if n > 1 else n_rows, dtype=codes[name])
            for name, n in names.items()}

