"""Fingerprints of code, and what is kept of source files between two starts."""

import pytest

from virtual_soil.campaign.code import Code

MODULE = '"""Words."""\nfrom package import other\n\n\ndef twice(x):\n    return 2 * x\n'


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A checkout of a script and two modules, and an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    files = {"src/package/__init__.py": "", "src/package/module.py": MODULE, "src/package/other.py": "ONE = 1\n"}
    files["workflow/scripts/run.py"] = "import package.module\n"
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path


def fingerprint(checkout):
    return Code(checkout).of_script("run")


def kept(checkout):
    return sorted((checkout / "cache/virtual-soil/code").glob("*"))


def test_a_fingerprint_is_the_same_with_and_without_what_is_kept(checkout):
    first = fingerprint(checkout)
    assert len(kept(checkout)) == 4
    stamps = [path.stat().st_mtime_ns for path in kept(checkout)]
    assert fingerprint(checkout) == first
    assert [path.stat().st_mtime_ns for path in kept(checkout)] == stamps
    for path, damage in zip(kept(checkout), ("", "[1, 2]", '["a"]', "{}"), strict=True):
        path.write_text(damage, encoding="utf-8")
    assert fingerprint(checkout) == first


def test_what_cannot_be_kept_is_found_anew(checkout, monkeypatch):
    first = fingerprint(checkout)
    (checkout / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(checkout / "file"))
    assert fingerprint(checkout) == first


@pytest.mark.parametrize(
    ("old", "new", "same"), [("Words", "Other words", True), ("  return 2", "  # why\n    return 2", True), ("2 *", "3 *", False)]
)
def test_a_fingerprint_follows_the_code_of_an_imported_module_but_not_its_words(checkout, old, new, same):
    first, path = fingerprint(checkout), checkout / "src/package/module.py"
    path.write_text(MODULE.replace(old, new), encoding="utf-8")
    assert (fingerprint(checkout) == first) == same


def test_a_fingerprint_follows_what_an_imported_module_imports(checkout):
    first = fingerprint(checkout)
    (checkout / "src/package/other.py").write_text("ONE = 2\n", encoding="utf-8")
    assert fingerprint(checkout) != first
