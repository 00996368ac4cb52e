"""Start a study: `make new-study STUDY=<name> [SOIL=<name>]` writes a short configuration and a soil file to complete.

WHEEL, PLATE and CONE add these tools: `WHEEL="radius_m=0.1 width_m=0.08 load_n=20 slips=0,0.2,0.5"`, with the keys of the sections.
"""

import argparse
import re
from pathlib import Path
from string import Template

from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.experiments.registry import BY_DEFAULT, PAPERS, RESPONSES, chosen
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import NAME, defaults
from virtual_soil.campaign.soils import measure_soil
from virtual_soil.campaign.starter import NONE, sections_of, text_of


def own_targets(template: str) -> set[str]:
    """Responses that the starter's soil file has entries for; template : its text."""
    return {name for name, response in RESPONSES.items() if re.search(rf"^{response.column}:", template, flags=re.MULTILINE)}


def questions(targets: set[str]) -> tuple[list[str], list[str]]:
    """Experiments of a new study, and the responses that it weighs: those that its soil has targets for."""
    for experiments in (BY_DEFAULT, PAPERS):
        asked = {experiment.NAME: [r.name for r in experiment.RESPONSES if r.name in targets] for experiment in chosen(experiments)}
        if all(asked.values()):
            break
    return experiments, sorted(name for names in asked.values() for name in names)


def start(root: Path, study: str, soil: str | None = None, tools: dict[str, list[str]] | None = None) -> list[Path]:
    """Write config/<study>.yaml, and config/soils/<study>.yaml unless an existing soil is named; returns the written paths.

    tools : wheel, plate, cone -> words `key=value` (see `campaign.starter`). Exits with one line, without writing, if a name or a
    word is invalid, the soil unknown, or a file would be overwritten.
    """
    soils, starter = root / "config" / "soils", root / "config" / "starter"
    if not re.fullmatch(NAME, study):
        raise SystemExit(f"STUDY is {study!r}; allowed: letters, digits, - and _, as it names files and folders.")
    if soil is not None and not (soils / f"{soil}.yaml").is_file():
        known = ", ".join(sorted(path.stem for path in soils.glob("*.yaml")))
        raise SystemExit(f"SOIL is {soil!r}; allowed: {known}, or none, for a soil of your own.")
    files = {root / "config" / f"{study}.yaml": starter / "study.yaml"}
    if soil is None:
        files[soils / f"{study}.yaml"] = starter / "soil.yaml"
    for path in files:
        if path.exists():
            raise SystemExit(f"{path.relative_to(root)} exists already and is left as it is; allowed: another STUDY.")
    beside = text_of(sections_of(study, tools or {}, defaults(Study)))
    if soil is None:
        targets = own_targets((starter / "soil.yaml").read_text(encoding="utf-8"))
    else:
        targets = set(measure_soil(soils / f"{soil}.yaml")["property"])
    experiments, weighed = questions(targets)
    weights = ", ".join(f"{name}: 1" for name in weighed)
    named = {"study": study, "soil": soil or study, "experiments": f"[{', '.join(experiments)}]", "weights": f"{{{weights}}}"}
    for path, template in files.items():
        text = Template(template.read_text(encoding="utf-8")).substitute(named)
        path.write_text(text + (beside if template.name == "study.yaml" else ""), encoding="utf-8")
    return list(files)


def next_steps(study: str, soil: str | None, tools: dict[str, list[str]]) -> str:
    """Text of the next steps."""
    file = f"config/{study}.yaml"
    wheels = [f"    .venv/bin/snakemake -n {tool} --configfile {file}    # after it: the cost of this target\n" for tool in tools]
    own = "" if soil else f"Put what was measured into config/soils/{study}.yaml. Then:\n"
    return f"""{own}
    make first-answer SOIL={soil or study}                                # seconds, without simulations
    .venv/bin/snakemake -n all --configfile config/{study}.yaml      # what would run
    .venv/bin/snakemake -c2 all --configfile config/{study}.yaml     # run it: results/{study}/report.html
    make status STUDY={study}                                       # how far it is, from another terminal
{"".join(wheels)}"""


def main(arguments: list[str] | None = None) -> None:
    """Write the files of a new study."""
    parser = argparse.ArgumentParser(description="Start a study of one's own.")
    parser.add_argument("study", help="its name")
    parser.add_argument("soil", nargs="?", help="a soil in config/soils; without, a soil file to fill in is written")
    for tool in NONE:
        parser.add_argument(f"--{tool}", metavar="KEY=VALUE", help=f"words with keys of section {tool}; see docs/configuration.md")
    given = parser.parse_args(arguments)
    tools = {tool: words.split() for tool in NONE if (words := getattr(given, tool)) is not None}
    written = start(ROOT, given.study, given.soil, tools)
    print("Written: " + ", ".join(path.relative_to(ROOT).as_posix() for path in written))
    print(next_steps(given.study, given.soil, tools), end="")


if __name__ == "__main__":
    main()
