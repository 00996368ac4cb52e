"""CITATION.cff can be read by those who cite: the keys that Citation File Format 1.2.0 demands, and no other version than ours."""

import datetime
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text())
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_the_software_is_described_as_the_format_demands():
    assert {"cff-version", "message", "title", "authors"} <= set(CITATION)
    assert CITATION["cff-version"] == "1.2.0"
    assert CITATION["type"] == "software"
    assert CITATION["title"] == PROJECT["name"]
    assert CITATION["version"] == PROJECT["version"]
    assert CITATION["license"] == PROJECT["license"]


def test_the_paper_is_cited():
    (paper,) = CITATION["references"]
    assert {"type", "title", "authors", "journal", "year"} <= set(paper)
    assert [author["family-names"] for author in paper["authors"]] == ["Briend", "Radziszewski", "Pasini"]
    assert 1900 < paper["year"] <= datetime.date.today().year


@pytest.mark.parametrize("entry", [CITATION, *CITATION["references"]], ids=lambda entry: entry["type"])
def test_every_author_is_a_person_or_an_entity(entry):
    for author in entry["authors"]:
        assert ("name" in author) != ("family-names" in author and "given-names" in author)
        assert all(isinstance(value, str) for value in author.values())
