"""Fingerprints of code: a rule runs again when code that it runs changes its meaning, and only then.

Snakemake compares a script's time with its outputs' and knows nothing of the modules that the script imports. Here every module
of the project that a script imports, directly or through others, is found in the source and hashed; comments, docstrings, layout
and file times do not count.
"""

import ast
import functools
import hashlib
from collections.abc import Iterator
from pathlib import Path

#: The checkout that this package lies in.
ROOT = Path(__file__).resolve().parents[3]
SCRIPTS = Path("workflow/scripts")
#: Folders of a checkout in which an imported module is looked for.
SOURCES = (Path("src"), SCRIPTS)


class Code:
    """The code of a checkout; root : its folder."""

    def __init__(self, root: Path):
        self.root = root
        self.known: dict[str, tuple[Path, ...]] = {}

    def of_script(self, script: str, *modules: str) -> str:
        """Hash of a script in workflow/scripts and of all project modules that it imports (12 hex digits).

        modules : further modules by name, which the script imports by a name that it computes.
        """
        entries = [self.root / SCRIPTS / f"{script}.py", *(file for module in modules for file in self.files_of(module))]
        return self.combined(self.reached(entries))

    def of_package(self, folder: str, without: str | None = None) -> str:
        """Hash of every module of a package (12 hex digits), those below `without` excepted."""
        left_out = None if without is None else self.root / without
        return self.combined({path for path in (self.root / folder).rglob("*.py") if left_out not in path.parents})

    def combined(self, paths: set[Path]) -> str:
        """One hash of several files and their places."""
        digest = hashlib.sha256()
        for path in sorted(paths):
            digest.update(path.relative_to(self.root).as_posix().encode())
            digest.update(meaning(path, path.stat().st_mtime_ns).encode())
        return digest.hexdigest()[:12]

    def reached(self, entries: list[Path]) -> set[Path]:
        """The files, and all files of the project that these import."""
        found: set[Path] = set()
        waiting = list(entries)
        while waiting:
            path = waiting.pop()
            if path not in found:
                found.add(path)
                waiting += [file for name in imports(path, path.stat().st_mtime_ns) for file in self.files_of(name)]
        return found

    def files_of(self, name: str) -> tuple[Path, ...]:
        """Files that Python runs to import a name: its packages' and its own; none for what is not part of the project."""
        if name not in self.known:
            places = (tuple(files_below(self.root / source, name.split("."))) for source in SOURCES)
            self.known[name] = next((files for files in places if files), ())
        return self.known[name]


def files_below(folder: Path, parts: list[str]) -> Iterator[Path]:
    """Yield the files in a folder that Python runs to import a name."""
    for part in parts:
        folder = folder / part
        if folder.with_suffix(".py").is_file():
            yield folder.with_suffix(".py")
            return
        if not folder.is_dir():  # a name that the package defines
            return
        if (folder / "__init__.py").is_file():
            yield folder / "__init__.py"


@functools.cache
def parsed(path: Path, changed_ns: int) -> ast.Module:
    """The syntax tree of a file as it was at a time, without docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return tree


@functools.cache
def imports(path: Path, changed_ns: int) -> tuple[str, ...]:
    """Full names of everything a file imports, at its top or inside a function."""
    names: list[str] = []
    for node in ast.walk(parsed(path, changed_ns)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return tuple(names)


@functools.cache
def meaning(path: Path, changed_ns: int) -> str:
    """Hash of a file's code without comments, docstrings and layout."""
    return hashlib.sha256(ast.unparse(parsed(path, changed_ns)).encode()).hexdigest()
