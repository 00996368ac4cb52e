"""Send a script's output to its rule's log."""

import sys


def log_to(path: str) -> None:
    """Redirect standard output and error to a file, line by line, so that it can be followed while the script runs."""
    sys.stdout = sys.stderr = open(path, "w", buffering=1, encoding="utf-8")  # noqa: SIM115 (open until the process ends)
