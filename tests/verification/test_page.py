"""The page: what it counts, shows and links to."""

import re

import numpy as np
import pandas as pd

from virtual_soil.verification import Check, table_of
from virtual_soil.verification.page import write_page

RUNS = pd.DataFrame(
    {"kind": "heap", "variant": ["base", "base", "type C"], "seed": [1, 2, 1], "angle_of_repose_deg": [25.0, 27.0, 15.0]}
)


def table(group, *obtained):
    checks = [
        Check(group=group, case=f"case {k}", quantity="length", unit="m", source="s", expected=1.0, obtained=value, tolerance=0.1)
        for k, value in enumerate(obtained)
    ]
    return table_of(checks)


def test_the_page_counts_checks_and_shows_every_failure(tmp_path):
    page = tmp_path / "verification.md"
    write_page(
        {"first": table("First things", 1.0, 1.05, 2.0), "second": table("Second", np.nan)}, page, tmp_path / "verification", RUNS
    )
    text = page.read_text()
    assert "4 checks, **2 fail**." in text
    assert "| [First things](#first-things) | 3 | 1 |" in text
    assert "| case 2 | length | m | 1 | 2 | +1.0e+00 | 1.0e-01 | **FAIL** | s |" in text
    assert text.count("**FAIL**") == 2


def test_the_page_links_only_to_figures_that_exist(tmp_path):
    rows = [
        Check(group="Normal impact", case=case, quantity="restitution", unit="-", source="s", expected=0.5, obtained=0.51)
        for case in ("test 3: e = 0.5 asked for", "test 3: e = 0.5 asked for, default time step")
    ]
    points = [
        Check(
            group="Oblique impact", case="test 4: 20°", quantity=quantity, unit="-", source="a, digitised", expected=1, obtained=1
        )
        for quantity in ("tangential restitution", "spin")
    ]
    page, folder = tmp_path / "page.md", tmp_path / "page"
    bulk = table("Bulk", 1.0)
    write_page({"normal_impact": table_of(rows), "oblique_impact": table_of(points), "bulk": bulk}, page, folder, RUNS)
    links = re.findall(r"!\[.*?\]\((.*?)\)", page.read_text())
    assert links == ["page/restitution.png", "page/oblique_impact.png", "page/bulk.png"]
    assert all((tmp_path / link).stat().st_size > 5000 for link in links)
    assert len(list(folder.iterdir())) == 3
