"""Refuses folders in which Snakemake cannot run jobs, before the first job and before the installation (`make setup`).

Imports nothing but the standard library, because `make` runs it with the Python that makes the virtual environment.
"""

import re
import sys
from pathlib import Path

from virtual_soil.errors import InputError

#: Characters at which a shell takes a path apart or replaces it by others.
SPECIAL = re.compile(r"""[\s"'`$&|;<>()\[\]{}*?\\]""")
#: Characters of Snakemake's wildcards.
BRACES = re.compile("[{}]")

RENAME = "Rename or move it; delete the .venv of a checkout that was moved, and run `make` again."


class FolderError(InputError, ValueError):
    """Error: jobs cannot run in or from a folder; the message names it and the remedy."""


def check_folders(checkout: Path, working: Path, python: str) -> None:
    """Refuse folders with braces, and an interpreter whose path a shell would take apart: Snakemake 9 does not quote it.

    checkout : folder of the Snakefile; working : folder of the results; python : path of the interpreter.
    """
    for folder, name in ((checkout, "checkout"), (working, "working directory")):
        if found := BRACES.search(str(folder)):
            raise FolderError(
                f"{folder}: the name of the {name} has {found[0]!r}, which Snakemake takes for a wildcard; allowed: a folder "
                f"without braces. {RENAME}"
            )
    if found := SPECIAL.search(python):
        raise FolderError(
            f"{python}: the path of Python has {found[0]!r}, which the shell that starts the jobs misreads; allowed: a folder "
            f"without blanks, quotes, brackets and other special characters. {RENAME}"
        )


def main() -> None:
    """Check the working directory as a checkout in which .venv is to be made."""
    try:
        check_folders(Path.cwd(), Path.cwd(), str(Path.cwd() / ".venv" / "bin" / "python"))
    except FolderError as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()
