"""Fingerprints of code: a rule is rerun if and only if the code that it executes has changed.

Snakemake compares modification times of scripts and ignores imported modules. The fingerprint covers a script and every project
module that it imports directly or indirectly. It excludes comments, docstrings, formatting and modification times.
"""

import ast
import functools
import hashlib
from collections.abc import Iterator
from pathlib import Path

#: Root of the checkout that contains this package.
ROOT = Path(__file__).resolve().parents[3]
SCRIPTS = Path("workflow/scripts")
#: Folders of a checkout that are searched for imported modules.
SOURCES = (Path("src"), SCRIPTS)


class Code:
    """Code of a checkout; root : its folder."""

    def __init__(self, root: Path):
        self.root = root
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
        for path in sorted(paths):
            digest.update(path.relative_to(self.root).as_posix().encode())
            digest.update(meaning(path, path.stat().st_mtime_ns).encode())
        return digest.hexdigest()[:12]

    def reached(self, entries: list[Path]) -> set[Path]:
        """Return the given files and all project files that they import, directly or indirectly."""
        found: set[Path] = set()
        waiting = list(entries)
        while waiting:
            path = waiting.pop()
            if path not in found:
                found.add(path)
                waiting += [file for name in imports(path, path.stat().st_mtime_ns) for file in self.files_of(name)]
        return found

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


@functools.cache
def parsed(path: Path, changed_ns: int) -> ast.Module:
    """Syntax tree of a file without docstrings, cached by modification time."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return tree


@functools.cache
def imports(path: Path, changed_ns: int) -> tuple[str, ...]:
    """Full names of all imports of a file, at module level or inside functions."""
    names: list[str] = []
    for node in ast.walk(parsed(path, changed_ns)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return tuple(names)


@functools.cache
def meaning(path: Path, changed_ns: int) -> str:
    """Hash of a file's code without comments, docstrings and formatting."""
    return hashlib.sha256(ast.unparse(parsed(path, changed_ns)).encode()).hexdigest()
