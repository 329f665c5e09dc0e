"""Words for people."""


def counted(n: int, noun: str) -> str:
    """
    Return a count with its noun.

    Parameters
    ----------
    n : int
    noun : str
        In the singular; its plural takes an s.

    Returns
    -------
    str
        Such as ``1 cell`` or ``2 cells``.

    """
    return f'{n} {noun}' if n == 1 else f'{n} {noun}s'
