"""What comes of an action, as one sentence for a person."""

from typing import NamedTuple


class Answer(NamedTuple):
    """
    What came of a request.

    Parameters
    ----------
    success : bool
    message : str
        One sentence about it, for who types keys.
    code : str
        The same for a page with words of its own; empty where the action says it all.

    """

    success: bool
    message: str
    code: str = ''

    @property
    def sentence(self) -> str:
        """Return what is told: what was done, or that it was not and why."""
        text = self.message if self.success else f'Not done: {self.message}'
        # Whoever reads it is in it. A bag's name stays as people have to type it.
        text = text.replace(' in teleop_node', '')
        begins = text[:1].upper() if text.split(' ')[0].isalpha() else text[:1]
        return f'{begins}{text[1:]}' + ('' if text.endswith(('.', '?', '!')) else '.')


def absence(node: str) -> str:
    """Say that a node is not there, and what to do."""
    return (f'{node} is not there; start it in another terminal, with the same ROS_DOMAIN_ID as '
            f'here')
