"""Files that are whole or not there: written under another name first, brought to the disk, then renamed."""

import contextlib
import os
from pathlib import Path

from virtual_soil.errors import InputError

#: How the name of a file that is not whole yet begins; what a killed job leaves under it is of no use to anybody.
PART = ".part-"


class FileError(InputError, OSError):
    """A file that cannot be written; the message names it and says what to do."""


@contextlib.contextmanager
def writing(path: str | Path):
    """While inside, what the system says of a full disk, a write-protected folder, ... becomes a FileError that names the file."""
    try:
        yield
    except FileError:
        raise
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise FileError(f"{path}: cannot be written ({reason}). Make room or lift the protection, then run again.") from error


@contextlib.contextmanager
def whole(path: str | Path):
    """Gives the name to write to; the file gets its own name when all is written, and does not appear at all when that fails.

    The name carries the process's number: a job that outlived its Snakemake and the one that replaces it do not meet. Raises what
    `writing` raises.
    """
    path = Path(path)
    part = path.with_name(f"{PART}{os.getpid()}-{path.name}")
    try:
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            yield part
            with open(part, "rb") as file:
                os.fsync(file.fileno())
            os.replace(part, path)
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write a text as UTF-8, whole or not at all; raises what `whole` raises."""
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")
