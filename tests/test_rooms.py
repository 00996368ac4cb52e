"""What multiplies has one room each: a name occurs in its own room, in the one list, and nearly nowhere else."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: Code of the product; the engine's own verification and the paper's printed values name what they are about.
FOLDERS = ("src", "workflow/scripts")
LEFT_OUT = ("src/virtual_soil/verification", "src/virtual_soil/calibration/paper")
#: Kind -> its names, and the number of files that may have one as a string of their own.
NAMES = {
    "experiments": ({"repose", "shear"}, 7),
    "responses": (
        {"cohesion", "cohesion_pa", "friction_angle", "friction_angle_deg", "angle_of_repose", "angle_of_repose_deg"},
        9,
    ),
    "options of the laws": ({"type_a", "type_c", "edem", "no_pull"}, 7),
}


def strings(path):
    """All strings of a file, docstrings excepted."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None
    }
    return {
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings
    }


def naming(names):
    """Files in which one of the names is a string, or a key or word of one in quotation marks."""
    files = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]
    places = {path.relative_to(ROOT).as_posix(): strings(path) for path in files}
    return [place for place, found in places.items() if found & names and not place.startswith(LEFT_OUT)]


@pytest.mark.parametrize("kind", NAMES)
def test_names_stay_in_their_rooms(kind):
    names, most = NAMES[kind]
    found = naming(names)
    assert 0 < len(found) <= most, "\n".join(found)
