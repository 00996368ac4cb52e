"""Atomic writing of files: written under a temporary name, synchronised to disk, then renamed."""

import contextlib
import os
from pathlib import Path

from virtual_soil.errors import InputError

#: Prefix of the name of an incomplete file; files with it that a killed job leaves behind can be deleted.
PART = ".part-"


class FileError(InputError, OSError):
    """Error: a file cannot be written; the message names it and the remedy."""


@contextlib.contextmanager
def writing(path: str | Path):
    """Context manager: convert system errors (full disk, write-protected folder, ...) into a FileError that names the file."""
    try:
        yield
    except FileError:
        raise
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise FileError(f"{path}: cannot be written ({reason}). Make room or lift the protection, then run again.") from error


@contextlib.contextmanager
def whole(path: str | Path):
    """Context manager: yield a temporary name to write to; the file is renamed at the end, or removed after an error.

    The temporary name contains the process id, so that a job that outlived its Snakemake and its replacement use different files.
    Raises the errors of `writing`.
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
    """Write a text as UTF-8 atomically; raises the errors of `whole`."""
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")
