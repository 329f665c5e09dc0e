"""What a user did wrong."""


class UserError(Exception):
    """A mistake of the user's; the message is one line: what, where, what to do."""
