"""The one exception for bad input: what came in, where, and what was expected."""


class InputError(ValueError):
    """Bad input from outside; the message names the file, key or value and what was expected instead."""
