"""What the eight headings are called: the way of +x is east, that of +y north."""

from typing import Final

from control_field.headings import N_HEADINGS

#: Index 0 along +x.
COMPASS: Final = ('E', 'NE', 'N', 'NW', 'W', 'SW', 'S', 'SE')
#: What people call them.
DIRECTIONS: Final = dict(zip((*COMPASS, '-'), (
    'east', 'north-east', 'north', 'north-west', 'west', 'south-west', 'south', 'south-east',
    'nowhere'), strict=True))


def compass(heading: int) -> str:
    """Return the name of a heading, ``-`` for none."""
    return COMPASS[heading] if 0 <= heading < N_HEADINGS else '-'
