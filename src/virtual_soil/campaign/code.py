"""Fingerprints of code: a rule is rerun if and only if the code that it executes has changed.

Snakemake compares modification times of scripts and ignores imported modules. The fingerprint covers a script and every project
module that it imports directly or indirectly. It excludes comments, docstrings, formatting and modification times.

Every start of Snakemake needs the syntax trees of all files: what is needed of them is kept in the user's cache.
"""

import ast
import contextlib
import hashlib
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from dem.cache import user_folder

#: Root of the checkout that contains this package.
ROOT = Path(__file__).resolve().parents[3]
SCRIPTS = Path("workflow/scripts")
#: Folders of a checkout that are searched for imported modules.
SOURCES = (Path("src"), SCRIPTS)


class Content(NamedTuple):
    """meaning : hash of a file's code without comments, docstrings and formatting. imports : full names of all its imports."""

    meaning: str
    imports: list[str]


class Code:
    """Code of a checkout as it is when a file is first asked for; root : its folder."""

    def __init__(self, root: Path):
        self.root = root
        self.contents: dict[Path, Content] = {}
        self.needs: dict[Path, set[Path]] = {}
        self.known: dict[str, tuple[Path, ...]] = {}

    def of_script(self, script: str, *modules: str) -> str:
        """Hash of a script in workflow/scripts and of all project modules that it imports (12 hex digits).

        modules : names of further modules, imported dynamically by the script.
        """
        entries = [self.root / SCRIPTS / f"{script}.py", *(file for module in modules for file in self.files_of(module))]
        return self.combined(self.reached(entries))

    def of_package(self, folder: str, without: str | None = None) -> str:
        """Hash of every module of a package, except those below `without` (12 hex digits)."""
        left_out = None if without is None else self.root / without
        return self.combined({path for path in (self.root / folder).rglob("*.py") if left_out not in path.parents})

    def combined(self, paths: set[Path]) -> str:
        """Hash of several files and their paths."""
        digest = hashlib.sha256()
        for path in sorted(paths, key=lambda path: path.parts):
            digest.update(path.relative_to(self.root).as_posix().encode())
            digest.update(self.content(path).meaning.encode())
        return digest.hexdigest()[:12]

    def reached(self, entries: list[Path]) -> set[Path]:
        """Return the given files and all project files that they import, directly or indirectly."""
        found, new = set(), set(entries)
        while new:
            found |= new
            new = set().union(*map(self.needed, new)) - found
        return found

    def needed(self, path: Path) -> set[Path]:
        """Project files that a file imports itself."""
        if path not in self.needs:
            self.needs[path] = {file for name in self.content(path).imports for file in self.files_of(name)}
        return self.needs[path]

    def content(self, path: Path) -> Content:
        """What counts of a file."""
        if path not in self.contents:
            self.contents[path] = kept_or_found(path.read_bytes())
        return self.contents[path]

    def files_of(self, name: str) -> tuple[Path, ...]:
        """Files executed by the import of a name: its packages and the module; empty if the name is not part of the project."""
        if name not in self.known:
            places = (tuple(files_below(self.root / source, name.split("."))) for source in SOURCES)
            self.known[name] = next((files for files in places if files), ())
        return self.known[name]


def files_below(folder: Path, parts: list[str]) -> Iterator[Path]:
    """Yield the files in a folder that the import of a name executes."""
    for part in parts:
        folder = folder / part
        if folder.with_suffix(".py").is_file():
            yield folder.with_suffix(".py")
            return
        if not folder.is_dir():  # the name is defined in the package
            return
        if (folder / "__init__.py").is_file():
            yield folder / "__init__.py"


def kept_or_found(source: bytes) -> Content:
    """Content of a source file, from the user's cache or from its syntax tree, which is then kept there."""
    folder = user_folder()
    key = hashlib.sha256(sys.version.encode() + source).hexdigest()[:32]  # another Python may write the same tree in other words
    file = None if folder is None else folder / "code" / f"{key}.json"
    content = None if file is None else kept(file)
    if content is None:
        content = found(source)
        if file is not None:
            keep(file, content)
    return content


def kept(file: Path) -> Content | None:
    """Content from a file of the cache; None if there is none, or it is damaged."""
    try:
        content = Content(*json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    return content if isinstance(content.meaning, str) and isinstance(content.imports, list) else None


def keep(file: Path, content: Content) -> None:
    """Write content into the cache, whole or not at all; without it, only time is lost."""
    part = file.with_name(f"{file.name}.{os.getpid()}.part")
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(json.dumps(content), encoding="utf-8")
        os.replace(part, file)


def found(source: bytes) -> Content:
    """Content of a source file."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return Content(hashlib.sha256(ast.unparse(tree).encode()).hexdigest(), list(imported(tree)))


def imported(tree: ast.Module) -> Iterator[str]:
    """Yield the full names of all imports, at module level or inside functions."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
