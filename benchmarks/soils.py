"""Soils that cohere, calibrated: the answers of several studies on one page.

    for study in regolith sand_slope fine_soils glass_beads; do snakemake -c2 all --configfile config/$study.yaml; done
    python benchmarks/soils.py

Writes docs/soils.md from the results that there are; simulates nothing.
"""

import json
from pathlib import Path

import pandas as pd
from regolith import answer_table

ROOT = Path(__file__).resolve().parents[1]
STUDIES = ("regolith", "sand_slope", "fine_soils", "glass_beads")

TEXT = """# Soils that cohere

Written by `python benchmarks/soils.py` from the answers of the studies named below
(`snakemake -c2 all --configfile config/<study>.yaml`). Soil files with their sources are in `config/soils/`. "Prediction" asks
whether new simulations confirm what the surrogates predicted, "target" whether the simulated soil has the measured value; both may
say no.

{soils}
"""

SOIL = """## {soil}

{comment}

Study `{study}`, {n} simulations, {minutes:.0f} core-minutes. Answer (95 % interval): {answer}.

{table}
"""


def comment_of(soil: str) -> str:
    """What a soil file says of itself, in its first lines."""
    lines = (ROOT / "config" / "soils" / f"{soil}.yaml").read_text(encoding="utf-8").splitlines()
    return "\n".join(line.lstrip("# ") for line in lines if line.startswith("#"))


def answer_of(optimum: pd.Series, design: pd.DataFrame) -> str:
    """The parameters that were sought, each with its interval."""
    found = [
        (name, *(float(optimum[f"{name}_{end}_95"]) for end in ("low", "high"))) for name in design if f"{name}_low_95" in optimum
    ]
    edges = {name: " at the edge of the design" for name in str(optimum["at_bound"]).split(",")}
    return ", ".join(
        f"`{name}` {optimum[name]:.4g}{edges.get(name, '')} ({low:.4g} to {high:.4g})" for name, low, high in found if low < high
    )


def spent(folder: Path) -> tuple[int, float]:
    """Number of simulations of a study and their wall time in minutes."""
    times = [json.loads(path.read_text(encoding="utf-8"))["wall_time_s"] for path in sorted(folder.glob("sims/*/*/timing.json"))]
    return sum(map(len, times)), sum(sum(by_run.values()) for by_run in times) / 60.0


def sections(study: str) -> list[str]:
    """The soils of one study."""
    folder = ROOT / "results" / study
    verification, design = (pd.read_parquet(folder / f"{name}.parquet") for name in ("verification", "design"))
    n, minutes = spent(folder)
    found = []
    for _, optimum in pd.read_parquet(folder / "calibration.parquet").iterrows():
        table = "\n".join(answer_table(verification[verification["case"] == optimum["case"]]))
        answer, comment = answer_of(optimum, design), comment_of(optimum["soil"])
        found.append(
            SOIL.format(soil=optimum["soil"], comment=comment, study=study, n=n, minutes=minutes, answer=answer, table=table)
        )
    return found


def main() -> None:
    """Write the page."""
    done = [study for study in STUDIES if (ROOT / "results" / study / "verification.parquet").is_file()]
    text = TEXT.format(soils="\n".join(part for study in done for part in sections(study)).rstrip())
    (ROOT / "docs" / "soils.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
