"""Folders in the user's cache; a temporary folder for the compiled kernels where that cannot be written (no home, a full disk)."""

import contextlib
import os
import stat
import sys
import tempfile
from pathlib import Path


def kernel_folder(version: str) -> Path:
    """Writable folder for the kernels of one version of the source; says in one line if it is a temporary one."""
    wanted = wanted_folder(version)
    if wanted is not None and is_writable(wanted):
        return wanted
    folder = private_folder() / "kernels" / version
    reason = "there is no home folder" if wanted is None else f"{wanted} cannot be written"
    print(f"dem: {reason}; kernels are compiled into {folder}. NUMBA_CACHE_DIR names another folder.", file=sys.stderr)
    return folder


def wanted_folder(version: str) -> Path | None:
    """NUMBA_CACHE_DIR, or a folder in the user's cache; None for a user without a home."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return Path(os.environ["NUMBA_CACHE_DIR"])
    folder = user_folder()
    return None if folder is None else folder / "kernels" / version


def user_folder() -> Path | None:
    """Folder of the project in the user's cache, which need not exist; None for a user without a home."""
    try:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    except RuntimeError:
        return None
    return Path(base) / "virtual-soil"


def is_writable(folder: Path) -> bool:
    """True if files can be written into a folder, which is created."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def private_folder() -> Path:
    """Temporary folder of this user, the same for all processes, so that they share compiled kernels.

    Code is loaded from it: if someone else could write there, a folder of this process alone takes its place.
    """
    folder = Path(tempfile.gettempdir()) / f"virtual-soil-{os.getuid()}"
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    found = folder.lstat()
    if stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077:
        return folder
    return Path(tempfile.mkdtemp(prefix="virtual-soil-"))
