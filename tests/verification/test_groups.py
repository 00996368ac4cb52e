"""Every check of every fast group, run through the engine."""

import ast
import functools
import re
from pathlib import Path

import pytest

from virtual_soil.campaign.tables import check_table
from virtual_soil.verification import table_of
from virtual_soil.verification.groups import GROUPS

SRC = Path(__file__).parents[2] / "src" / "virtual_soil" / "verification"
RULES = Path(__file__).parents[2] / "workflow" / "rules" / "verification.smk"


@functools.cache
def checks_of(name):
    return GROUPS[name]()


def failing(checks):
    return [f"{c.case}, {c.quantity}: {c.obtained:.7g}, not {c.expected:.7g} +- {c.tolerance:.1g}" for c in checks if not c.passed]


@pytest.mark.parametrize("name", GROUPS)
def test_the_engine_reproduces_what_is_published_or_exact(name):
    checks = checks_of(name)
    assert len(checks) > 5
    assert not failing(checks)


@pytest.mark.parametrize("name", GROUPS)
def test_no_row_of_the_page_stands_for_two_checks(name):
    table = check_table(table_of(checks_of(name)), "checks", name)
    assert not table.duplicated(["case", "quantity"]).any()
    assert table["group"].nunique() == 1


def test_the_workflow_knows_all_groups():
    listed = re.search(r"GROUPS = \[(.*?)\n\]", RULES.read_text(), re.DOTALL)[1]
    assert re.findall(r'"(\w+)"', listed) == list(GROUPS)


def test_cases_use_the_public_api_only():
    for path in SRC.glob("*.py"):
        if path.name in ("bulk.py", "strength.py"):  # heaps and shear tests go through the experiments
            continue
        nodes = list(ast.walk(ast.parse(path.read_text())))
        modules = [node.module for node in nodes if isinstance(node, ast.ImportFrom)]
        modules += [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
        assert not [module for module in modules if module.startswith("dem.")], path
        assert not [node.attr for node in nodes if isinstance(node, ast.Attribute) and node.attr.startswith("_")], path
