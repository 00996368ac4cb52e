"""Shear strengths of an AGS4 file: groups SHBG (a set of shear-box tests) and SHBT (its stages).

SHBT states normal stress, peak and residual shear stress of each stage (headings of the standard's dictionary, editions 4.0.3 to
4.2); the format has no curves. A set has the key that both groups share. A file may hold sets of many boreholes and samples; the
soil file chooses one (`sample`). Stages of several sets are one line only where the soil file lists them.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from virtual_soil.calibration.errors import demand
from virtual_soil.campaign.laboratory.ags import NUMBER, Group, is_ags, read_groups
from virtual_soil.campaign.laboratory.entry import is_number
from virtual_soil.campaign.laboratory.rows import Row

#: Headings whose texts tell sets apart, and the number of a stage within its set.
KEY, STAGE = ("LOCA_ID", "SAMP_TOP", "SAMP_REF", "SAMP_TYPE", "SAMP_ID", "SPEC_REF", "SPEC_DPTH"), "SHBT_TESN"
#: Those that hold depths: 2.5 is 2.50; references are compared as texts.
DEPTHS = ("SAMP_TOP", "SPEC_DPTH")
#: Strength -> its heading, and that of the normal stress measured beside it, which files from edition 4.1 on may have.
STATED = {"peak": ("SHBT_PEAK", "SHBT_PVST"), "steady": ("SHBT_RES", "SHBT_RVST")}
#: Keys of an entry that say how a table is to be read; AGS4 leaves nothing of it open.
OF_TABLES = ("columns", "decimal", "sheet", "rows")
#: Number of sets that a message lists.
SHOWN = 20


class Stage(NamedTuple):
    """A row of SHBT with the group it stands in, and the key of its set."""

    group: Group
    row: Row
    key: tuple[str, ...]


def ags_strengths(key: str, entry: dict, paths: list[Path], kind: str) -> tuple[dict[str, tuple[float, float]], str]:
    """Normal stress and strength in Pa of every stage by its label, and what was done, in words.

    key : soil file and entry, for messages. kind : strength asked for. Raises CalibrationError if there are several sets to choose
    from, with their list, or if a row cannot be what it says.
    """
    for name in OF_TABLES:
        demand(entry.get(name) is None, f"{key}.{name}", repr(entry.get(name)), "none: an AGS4 file states its own")
    demand(all(map(is_ags, paths)), f"{key}.file", ", ".join(path.name for path in paths), "AGS4 files alone, or none")
    demand(kind in STATED, f"{key}.strength", kind, f"{' or '.join(STATED)}: AGS4 holds no curves")
    files = [read_groups(path, ("SHBG", "SHBT"), entry.get("encoding")) for path in paths]
    for path, groups in zip(paths, files, strict=True):
        demand("SHBT" in groups, f"{path}: groups", ", ".join(groups), f"SHBT among them{advice(groups.get('SHBG'))}")
    stages = [
        Stage(groups["SHBT"], row, tuple(groups["SHBT"].text(row, name) for name in KEY))
        for groups in files
        for row in groups["SHBT"].rows
    ]
    chosen = chosen_stages(key, entry.get("sample"), stages)
    points, remarks = points_of(chosen, kind)
    sets = list(dict.fromkeys(stage.key for stage in chosen))
    own = [text for groups in files for text in stated_by_laboratory(groups.get("SHBG"), sets, kind)]
    remarks = ["strengths as the file states them", f"AGS4 set {' and '.join(map(described, sets))}", *own, *remarks]
    return points, "".join(f", {text}" for text in remarks)


def advice(general: Group | None) -> str:
    """Advice for a file with results of the laboratory's own regression only."""
    if general is None or not general.rows:
        return ""
    return (
        "; SHBG has cohesions and angles of friction only: give them as values with `standard_uncertainty`, "
        "`peak_cohesion_pa: {value: ..., standard_uncertainty: ..., source: ...}`"
    )


def chosen_stages(key: str, sample, stages: list[Stage]) -> list[Stage]:
    """Stages of the one set that `sample` (heading -> text, or list of texts) leaves; of several where it lists them."""
    ok = sample is None or (isinstance(sample, Mapping) and bool(sample) and set(sample) <= set(KEY))
    demand(ok, f"{key}.sample", repr(sample), f"a mapping of headings to their texts; headings: {', '.join(KEY)}")
    wanted = {name: value if isinstance(value, list) else [value] for name, value in (sample or {}).items()}
    for name, values in wanted.items():
        texts = all(isinstance(value, str) or is_number(value) for value in values) and bool(values)
        demand(texts, f"{key}.sample.{name}", repr(values), "a text, or a list of texts")
    every = list(dict.fromkeys(stage.key for stage in stages))
    demand(bool(every), f"{key}: number of rows in SHBT", 0, "at least one")
    found: dict[tuple[int, ...], list[tuple[str, ...]]] = {}
    for one in every:
        places = [
            next((k for k, value in enumerate(values) if same(name, one[KEY.index(name)], value)), -1)
            for name, values in wanted.items()
        ]
        if -1 not in places:
            found.setdefault(tuple(places), []).append(one)
    demand(bool(found), f"{key}.sample", dict(sample or {}), f"a set of the file: {listed(every)}")
    several = next((sets for sets in found.values() if len(sets) > 1), None)
    allowed = "one, chosen by `sample: {HEADING: text}` in the soil file; a list of texts takes sets together"
    demand(several is None, f"{key}: sets of shear tests", listed(several or []), allowed)
    for k, (name, values) in enumerate(wanted.items()):
        unused = [value for place, value in enumerate(values) if all(places[k] != place for places in found)]
        demand(not unused, f"{key}.sample.{name}", ", ".join(map(repr, unused)), f"a set of the file: {listed(every)}")
    taken = {sets[0] for sets in found.values()}
    return [stage for stage in stages if stage.key in taken]


def same(heading: str, text: str, value) -> bool:
    """True if a text of the file is the one that the soil file names."""
    wanted = str(value).strip()
    if heading in DEPTHS and NUMBER.fullmatch(text) and NUMBER.fullmatch(wanted):
        return float(text) == float(wanted)
    return text.casefold() == wanted.casefold()


def listed(sets: list[tuple[str, ...]]) -> str:
    """Sets in words, each by the headings that tell it from the others."""
    apart = differing(sets) or list(range(len(KEY)))
    texts = ["(" + ", ".join(f"{KEY[k]}: {one[k]!r}" for k in apart if one[k]) + ")" for one in sets]
    more = f" and {len(texts) - SHOWN} more" if len(texts) > SHOWN else ""
    return ", ".join(texts[:SHOWN]) + more


def differing(sets: list[tuple[str, ...]]) -> list[int]:
    """Places in KEY of the headings in which sets differ."""
    return [k for k in range(len(KEY)) if len({one[k] for one in sets}) > 1]


def described(one: tuple[str, ...]) -> str:
    """A set's key in words."""
    return " ".join(f"{name} {text}" for name, text in zip(KEY, one, strict=True) if text)


def points_of(stages: list[Stage], kind: str) -> tuple[dict[str, tuple[float, float]], list[str]]:
    """Points of stages that state the strength asked for, and what was left out, in words."""
    heading, beside = STATED[kind]
    for group in {id(stage.group): stage.group for stage in stages}.values():
        for name in ("SHBT_NORM", heading):
            has = ", ".join(name for name in group.headings if name not in KEY)
            demand(name in group.headings, f"{group.path}: headings of SHBT", has, f"{name} among them")
    full = [stage for stage in stages if stage.group.text(stage.row, heading)]
    demand(bool(full), f"{stages[0].group.path}: number of stages with {heading}", 0, "at least one")
    measured = all(stage.group.text(stage.row, beside) for stage in full)
    seen: dict[tuple, int] = {}
    points: dict[str, tuple[float, float]] = {}
    apart = differing([stage.key for stage in full])
    for stage in full:
        check_once(stage, seen)
        check_order(stage)
        stress = stage.group.number(stage.row, beside if measured else "SHBT_NORM", "stress")
        number = stage.group.text(stage.row, STAGE) or f"{stage.group.path.name} line {stage.row.line}"
        points[" ".join([*(stage.key[k] for k in apart), number])] = (stress, stage.group.number(stage.row, heading, "stress"))
    remarks = [f"normal stresses {beside if measured else 'SHBT_NORM'}"]
    left = len(stages) - len(full)
    return points, [*remarks, *([f"{left} stages without {heading} left out"] if left else [])]


def check_once(stage: Stage, seen: dict[tuple, int]) -> None:
    """Raise CalibrationError if a stage stands in the file, or in another, already."""
    number = stage.group.text(stage.row, STAGE)
    identity = (stage.key, number) if number else (stage.key, *stage.row.cells)
    where = f"{stage.group.path}, line {stage.row.line}: stage {number or 'without a number'} of {described(stage.key)}"
    demand(identity not in seen, where, f"in line {seen.get(identity)} already", "once; its key is to be unique (rule 10a)")
    seen[identity] = stage.row.line


def check_order(stage: Stage) -> None:
    """Raise CalibrationError if a stage's residual shear stress exceeds its peak: headings or numbers are exchanged."""
    group, row = stage.group, stage.row
    if group.text(row, "SHBT_PEAK") and group.text(row, "SHBT_RES"):
        peak, residual = (group.number(row, heading, "stress") for heading in ("SHBT_PEAK", "SHBT_RES"))
        demand(residual <= peak, f"{group.path}, line {row.line}, SHBT_RES", f"{residual:g} Pa", f"the peak, {peak:g} Pa, at most")


def stated_by_laboratory(general: Group | None, sets: list[tuple[str, ...]], kind: str) -> list[str]:
    """What SHBG says of the sets: kind of test, condition, and the laboratory's own line, as the file writes them."""
    if general is None:
        return ["no group SHBG: kind of test not stated"]
    own = {"peak": ("SHBG_PCOH", "SHBG_PHI"), "steady": ("SHBG_RCOH", "SHBG_RPHI")}[kind]
    texts = []
    for row in general.rows:
        if tuple(general.text(row, name) for name in KEY) in sets:
            texts += [general.text(row, name) for name in ("SHBG_TYPE", "SHBG_COND")]
            line = [f"{general.text(row, name)} {general.unit(name)}" for name in own if general.text(row, name)]
            texts += [f"the laboratory's own line {' and '.join(line)}"] if line else []
    return [text for text in dict.fromkeys(texts) if text]
