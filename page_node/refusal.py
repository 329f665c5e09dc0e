"""What is answered to a request that cannot be met: a code for the page, and a sentence."""


class RefusedError(Exception):
    """
    A request that is refused; the page finds the words for its code.

    Parameters
    ----------
    code : str
        Such as ``gone``: the page's texts have a sentence for each.
    message : str
        What is wrong, in a line.
    status : int
        Of HTTP.

    """

    def __init__(self, code: str, message: str = '', status: int = 404) -> None:
        super().__init__(code, message, status)
        self.code, self.message, self.status = code, message, status

    def __str__(self) -> str:
        """Return the sentence, or the code where there is none."""
        return self.message or self.code
