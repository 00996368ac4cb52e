"""Send a script's output to its rule's log, and say in one line what a person has to mend."""

import sys
import traceback

from virtual_soil.errors import InputError


def log_to(path: str) -> None:
    """Redirect standard output and error to a file, line by line, so that it can be followed while the script runs.

    An error that its message explains is one line, `error: ...`; a fault of the program is a traceback.
    """
    sys.stdout = sys.stderr = open(path, "w", buffering=1, encoding="utf-8")  # noqa: SIM115 (open until the process ends)
    sys.excepthook = report


def report(kind: type[BaseException], error: BaseException, trace) -> None:
    """Print an exception that nobody caught."""
    if isinstance(error, InputError):
        print(f"error: {error}", file=sys.stderr)
    else:
        traceback.print_exception(kind, error, trace)
