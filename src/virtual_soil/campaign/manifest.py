"""The manifest of a finished study: SHA-256 of every file, in the format of `sha256sum`, so that other programs can check it.

Checkpoints and incomplete files of killed jobs are excluded.
"""

import hashlib
from pathlib import Path

from virtual_soil.campaign.files import PART, write_text

NAME = "manifest.sha256"
#: Subfolder of a study that is excluded from the manifest.
LEFT_OUT = "checkpoints"


class ManifestError(ValueError):
    """Error: the manifest is missing or invalid."""


def hashes(folder: str | Path) -> dict[str, str]:
    """Return path below the folder -> SHA-256 (64 hex digits) of every file except the manifest, in path order."""
    folder = Path(folder)
    paths = sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    found = {}
    for path in paths:
        if path.as_posix() != NAME and path.parts[0] != LEFT_OUT and not path.name.startswith(PART):
            with open(folder / path, "rb") as file:
                found[path.as_posix()] = hashlib.file_digest(file, "sha256").hexdigest()
    return found


def write_manifest(folder: str | Path) -> None:
    """Write the manifest of a study's folder atomically."""
    path = Path(folder) / NAME
    lines = [f"{digest}  {name}\n" for name, digest in hashes(folder).items()]
    write_text(path, "".join(lines))


def read_manifest(folder: str | Path) -> dict[str, str]:
    """Read path -> SHA-256 from the manifest of a study's folder; raises ManifestError if it is missing or invalid."""
    path = Path(folder) / NAME
    if not path.is_file():
        raise ManifestError(f"{path} is missing; it is written when a study is finished: snakemake all.")
    listed = {}
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        digest, separator, name = line.partition("  ")
        if not (separator and name and len(digest) == 64 and set(digest) <= set("0123456789abcdef")):
            raise ManifestError(f"{path}: line {number} is {line!r}; allowed: 64 hex digits, two blanks, a path.")
        listed[name] = digest
    return listed


def differences(folder: str | Path) -> list[str]:
    """Return one line per file that differs from the manifest (changed, missing, or not listed), in path order."""
    listed, found = read_manifest(folder), hashes(folder)
    lines = {name: "missing" for name in listed.keys() - found.keys()}
    lines |= {name: "not in the manifest" for name in found.keys() - listed.keys()}
    lines |= {name: "changed" for name in listed.keys() & found.keys() if listed[name] != found[name]}
    return [f"{Path(folder) / name}: {lines[name]}" for name in sorted(lines)]
