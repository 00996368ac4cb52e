"""Errors whose message says all that a person needs to mend the input: shown as one line, without a traceback."""


class InputError(Exception):
    """Input, file or setting that cannot be used; the message names it, its value and what is allowed."""
