"""Redirect a script's output to its rule's log, and report input errors in one line."""

import sys
import traceback

from virtual_soil.errors import InputError


def log_to(path: str) -> None:
    """Redirect standard output and error to a file, line-buffered, so that the file can be followed while the script runs.

    Input errors are reported as one line, `error: ...`, program errors with a traceback.
    """
    sys.stdout = sys.stderr = open(path, "w", buffering=1, encoding="utf-8")  # noqa: SIM115 (open until the process ends)
    sys.excepthook = report


def report(kind: type[BaseException], error: BaseException, trace) -> None:
    """Print an uncaught exception."""
    if isinstance(error, InputError):
        print(f"error: {error}", file=sys.stderr)
    else:
        traceback.print_exception(kind, error, trace)
