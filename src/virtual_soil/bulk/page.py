"""The page of the bulk benchmarks, written from what was run."""

import textwrap
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from virtual_soil.bulk import compare, drum, figures, impact, silo
from virtual_soil.bulk.figures import DPI, NAMES
from virtual_soil.bulk.packings import Packing
from virtual_soil.bulk.variants import CASES, CODES, DRUM_BEGINNING, LIGGGHTS, OURS
from virtual_soil.verification.page import markdown

#: Times of the table of the impact, in ms.
IMPACT_TIMES_MS = (1, 3, 5, 7, 8, 9, 10, 11, 12, 15, 20, 25)
#: From here on the drum turns steadily, in s.
STEADY_DRUM_S = 1.0
#: Difference of the codes in any count of grains, over all grains; of an outflow from Beverloo's (the cone's share), and of their
#: ratio; change of an outflow over time.
COUNT_TOLERANCE, OUTFLOW_TOLERANCE, RATIO_TOLERANCE, CHANGE_TOLERANCE = 0.03, 0.2, 0.1, 0.05
SECONDS_PER_HOUR = 3600.0
#: Ratio of LIGGGHTS' processor time to ours that is wanted.
GOAL = 5.0
#: Smallest standard error of the ball's height in m, a thousandth of a grain's radius.
LEAST_ERROR_M = 1e-6
#: Stands for a section's figure in its text.
FIGURE = "<figure>"
CAPTIONS = {
    "impact": "Height and velocity of the ball, six starts in each code.",
    "drum": "Grains in the zones, and barycentres' paths (thick: zone 1, M2), three starts in each code.",
    "silo": "Grains above the orifice, and outflow over 50 ms or five samples (thick: large orifice).",
}
#: Why the soft drum has other steps than the benchmark's.
SOFT_STEP = (
    "The benchmark's soft variant has steps of 100 µs, 0.53 Rayleigh times of M1, which virtual-soil refuses beside rigid walls."
)

HEAD = """# Bulk benchmarks

Three benchmarks of Dosta et al. 2024 (Computer Physics Communications, article 109066) beside LIGGGHTS 3.8.0: impact of a ball,
rotating drum, emptying of a silo. Set-ups are those of two participants' public case files (MercuryDPM, YADE). Nothing on this page
is quoted from the article; the results of both codes come from the same machine, from the same packings, on one thread each.
`make bench-bulk` runs all cases again and rewrites this page; it needs LIGGGHTS and the published packings (`bulk.packings`).

Both codes: Hertz contact with the dashpot of the restitution, Mindlin's tangential spring with history, no rolling friction.
Coulomb's limit is LIGGGHTS' own in both (`tangential_model="liggghts"`): it bounds the spring alone, and the dashpot acts while a
contact sticks ([what our usual limit changes](decisions/11-bodies.md)). E = 1 GPa (M1), 0.5 GPa (M2), 210 GPa (steel), unless
stated.
"""

IMPACT = """## Impact

A steel ball of 20 mm falls at 5 m/s into a bed of grains of 2 mm (M1), full stiffness, steps of 0.5 µs. The ball starts 1 mm above
its first contact with the speed of its free fall. Six starts in each code: the ball at the centre, and up to 0.2 mm beside it.
"""

DRUM = """## Drum

8000 grains of 4 mm (M2) below 30 000 of 2 mm (M1) in a drum of radius 0.1 m that turns at 2 rad/s; the benchmark's run takes
5 s. The shell is round in both codes ([what a mesh does](decisions/11-bodies.md)). Zone 1 is x > 0, z > 0, zone 2 x < 0, z < 0;
the lowest point of the shell moves to +x. Three starts in each code: the published packing, and twice with every place changed at
random by up to 1 µm along each axis. *hard_beginning* is the first 0.02 s at full stiffness, of which only the speed counts.
"""

SILO = """## Silo

Grains of 4 mm (M1) run out of a cylinder of radius 0.1 m with a cone of 45°; orifices have radii of 20 mm (small) and 30 mm
(large). Filled by virtual-soil with the orifice closed; both codes start from this filling, and have the same 100 facets round.
Outflow is the slope of a parabola through the grains above the orifice, from 0.1 s on and while the cylinder holds grains;
constancy is its relative change over that time.
"""


@dataclass(frozen=True)
class Results:
    """Costs, one row per run; curves by (case, code, variant), wide; fillings of the silo by variant."""

    costs: pd.DataFrame
    curves: dict[tuple[str, str, str], pd.DataFrame]
    fillings: dict[str, Packing]

    def variants(self, case: str) -> list[str]:
        """Variants of a case that were run."""
        return list(dict.fromkeys(variant for name, _, variant in self.curves if name == case))

    def cost(self, case: str, code: str, variant: str) -> pd.Series:
        """Row of `costs` of a run."""
        rows = self.costs
        return rows[(rows["case"] == case) & (rows["code"] == code) & (rows["variant"] == variant)].iloc[0]

    def curve(self, case: str, code: str, variant: str) -> pd.DataFrame:
        """Curves of a run."""
        return self.curves[case, code, variant]


def write_page(results: Results, page: Path, folder: Path) -> None:
    """Write the page (Markdown) and its figures, bulk_<case>.png in a folder next to or below the page's."""
    folder.mkdir(parents=True, exist_ok=True)
    sections = {"impact": impact_section, "drum": drum_section, "silo": silo_section}
    parts = [HEAD, cost_section(results)]
    for case, write in sections.items():
        if not results.variants(case):
            continue
        text, figure = write(results)
        figure.savefig(folder / f"bulk_{case}.png", dpi=DPI, metadata={"Software": None})
        link = (folder / f"bulk_{case}.png").relative_to(page.parent).as_posix()
        parts.append(text.replace(FIGURE, f"![{CAPTIONS[case]}]({link})\n\n*{CAPTIONS[case]}*\n"))
    page.write_text("\n".join([*parts, not_run(results)]), encoding="utf-8")


def cost_section(results: Results) -> str:
    """Times of both codes, and their ratio."""
    rows, missed = [], []
    for case in ("impact", "drum", "silo"):
        for variant in results.variants(case):
            both = ours, theirs = [results.cost(case, code, variant) for code in CODES]
            walls = [f"{run['wall_s']:.0f}" for run in both]
            processors = [f"{run['processor_s']:.0f}" for run in both]
            speeds = [f"{1e-6 * run['grain_steps'] / run['processor_s']:.1f}" for run in both]
            ratio = theirs["processor_s"] / ours["processor_s"]
            missed += [f"{case}, {variant}"] if ratio < GOAL else []
            rows.append((f"{case}, {variant}", ours["n_grains"], ours["n_steps"], *walls, *processors, *speeds, f"{ratio:.1f}"))
    head = (
        "run", "grains", "steps", "wall, virtual-soil (s)", "wall, LIGGGHTS (s)", "processor, virtual-soil (s)",
        "processor, LIGGGHTS (s)", "virtual-soil (M grain-steps/s)", "LIGGGHTS (M grain-steps/s)", "ratio",
    )  # fmt: skip
    machines = ", ".join(dict.fromkeys(results.costs["processor"]))
    text = paragraph(
        f"Of the time loop on one thread of {machines}, without set-up. Speeds and their ratio are of the processor time: other",
        f"jobs ran on the machine, which lengthen the wall time. The goal is a ratio of {GOAL:g}.",
        f"It is missed in: {'; '.join(missed)}." if missed else "",
    )
    return f"## Time\n\n{text}\n{markdown(head, rows)}"


def impact_section(results: Results) -> tuple[str, Figure]:
    """Text and figure of the impact."""
    beds = list(dict.fromkeys(variant.split("_")[0] for variant in results.variants("impact")))
    by_bed, parts = {}, [IMPACT, FIGURE]
    for bed in beds:
        runs = {
            code: {
                int(variant.split("_")[1]): results.curve("impact", code, variant)
                for variant in results.variants("impact")
                if variant.startswith(f"{bed}_")
            }
            for code in CODES
        }
        by_bed[bed] = runs
        parts.append(impact_table(bed, *(list(runs[code].values()) for code in CODES)))
    return "\n".join(parts), figures.impact(by_bed)


def impact_table(bed: str, ours: list[pd.DataFrame], theirs: list[pd.DataFrame]) -> str:
    """Differences of the ball's height beside the scatter between starts, and the speed of the rebound."""
    height = compare.apart(ours, theirs, "ball_z_m")
    at = [k for t in IMPACT_TIMES_MS for k in np.flatnonzero(np.isclose(height.times_s, 1e-3 * t))]
    rows = [
        (
            f"{1e3 * height.times_s[k]:g}", f"{1e3 * height.ours[k]:.2f}", f"{1e3 * height.theirs[k]:.2f}",
            f"{1e3 * height.difference[k]:+.3f}", f"{1e3 * height.sd_ours[k]:.3f}", f"{1e3 * height.sd_theirs[k]:.3f}",
        )
        for k in at
    ]  # fmt: skip
    head = (
        "t (ms)",
        "virtual-soil z (mm)",
        "LIGGGHTS z (mm)",
        "difference",
        "sd of starts, virtual-soil",
        "sd of starts, LIGGGHTS",
    )
    largest = int(np.abs(height.difference).argmax())
    deepest = ", ".join(f"{1e3 * runs:.2f}" for runs in (height.ours.min(), height.theirs.min()))
    last = compare.apart(ours, theirs, "ball_speed_m_s")
    k = largest
    chance = compare.beyond_chance(ours, theirs, "ball_z_m", LEAST_ERROR_M)
    found = paragraph(
        f"Largest difference of the means: {1e3 * abs(height.difference[k]):.3f} mm at {1e3 * height.times_s[k]:g} ms,",
        f"where the starts scatter by {1e3 * height.sd_ours[k]:.3f} mm (virtual-soil)",
        f"and {1e3 * height.sd_theirs[k]:.3f} mm (LIGGGHTS).",
        f"In standard errors it is largest at {1e3 * chance.time_s:g} ms: {chance.errors:.1f}.",
        f"Of all ways to divide the {len(ours) + len(theirs)} runs into two codes, {100 * chance.share:.1f} % differ as much at",
        f"some time (below {100 * compare.LEAST_SHARE:g} % they would differ by more than chance):",
        f"{verdict(chance.share >= compare.LEAST_SHARE)}.",
        f"Lowest mean heights: {deepest} mm.",
        f"Velocity at the end: {last.ours[-1]:+.3f} ± {last.sd_ours[-1]:.3f} m/s in virtual-soil,",
        f"{last.theirs[-1]:+.3f} ± {last.sd_theirs[-1]:.3f} m/s in LIGGGHTS (± standard deviation of the starts).",
    )
    return f"{int(bed)} grains, means over the starts:\n\n{markdown(head, rows)}\n{found}"


def drum_section(results: Results) -> tuple[str, Figure]:
    """Text and figure of the drum."""
    variants = [variant for variant in results.variants("drum") if variant != DRUM_BEGINNING]
    kind, setup = variants[0].split("_")[0], drum.SETUPS[variants[0]]
    curves = {code: [results.curve("drum", code, variant) for variant in variants] for code in CODES}
    n_grains = int(results.cost("drum", OURS, variants[0])["n_grains"])
    rows = []
    for name in drum.GRAINS:
        rows += [drum_row(curves, f"{zone}_{name}", f"{name} in {zone.replace('_', ' ')}", n_grains) for zone in drum.ZONES]
        rows += [drum_row(curves, f"{axis}_{name}", f"barycentre {axis} of {name} (mm)", None) for axis in ("x", "z")]
    head = ("quantity", "at the start", "virtual-soil", "LIGGGHTS", "difference")
    largest = compare.zone_difference(curves[OURS], curves[LIGGGHTS], n_grains)
    lag = compare.lag_s(compare.apart(curves[OURS], curves[LIGGGHTS], "x_M1"))
    kept = " and ".join(f"{min(run['grains'].min() for run in curves[code]):.0f} ({NAMES[code]})" for code in CODES)
    softened = "" if setup.softening == 1 else f" The grains' E is divided by {setup.softening:g}; steel keeps its own."
    ran = paragraph(
        f"Run as variant *{kind}*: {setup.duration_s:g} s, steps of {1e6 * setup.time_step_s:.6g} µs in both codes.{softened}",
        SOFT_STEP if kind == "soft" else "",
    )
    found = paragraph(
        f"Largest difference of the means of a count: {100 * largest.share:.2f} % of all grains, at {largest.time_s:.2f} s",
        f"(tolerance {100 * COUNT_TOLERANCE:g} %: {verdict(largest.share <= COUNT_TOLERANCE)}), where the starts scatter by",
        f"{100 * largest.sd_ours:.2f} % (virtual-soil) and {100 * largest.sd_theirs:.2f} % (LIGGGHTS).",
        f"The barycentre x of M1 in LIGGGHTS follows that in virtual-soil by {1e3 * lag:+.0f} ms (means, closest on average).",
        f"Fewest grains in the drum: {kept} of {n_grains}.",
    )
    means_from = f"Means from {STEADY_DRUM_S:g} s on, ± standard deviation of the starts:\n"
    return "\n".join([DRUM, ran, FIGURE, means_from, markdown(head, rows), found]), figures.drum(curves)


def drum_row(curves: dict[str, list[pd.DataFrame]], column: str, name: str, n_grains: int | None) -> tuple[str, ...]:
    """Row of a quantity's steady means; n_grains : of all, for a count; None for a length."""
    factor, digits = (1.0, 0) if n_grains else (1e3, 2)
    steady = {code: [factor * run.loc[run.index >= STEADY_DRUM_S, column].mean() for run in curves[code]] for code in CODES}
    cells = [f"{np.mean(steady[code]):.{digits}f} ± {np.std(steady[code], ddof=1):.{digits}f}" for code in CODES]
    apart = float(np.mean(steady[OURS]) - np.mean(steady[LIGGGHTS]))
    difference = f"{100 * apart / n_grains:+.2f} %" if n_grains else f"{apart:+.2f} mm"
    return name, f"{factor * curves[OURS][0][column].iloc[0]:.{digits}f}", *cells, difference


def silo_section(results: Results) -> tuple[str, Figure]:
    """Text and figure of the silo."""
    rows, outflows, changes, worst = [], {}, [], []
    variants = results.variants("silo")
    curves = {variant: {code: results.curve("silo", code, variant) for code in CODES} for variant in variants}
    for variant in variants:
        setup, filling = silo.SETUPS[variant], results.fillings[variant]
        n_cone = silo.in_cone(filling, setup)
        cells = []
        for code in CODES:
            curve = curves[variant][code]
            chosen = curve[silo.steady(curve.index.to_numpy(), curve["above"].to_numpy(), n_cone)]
            outflow, change = silo.outflow_per_s(chosen.index.to_numpy(), chosen["above"].to_numpy())
            outflows[variant, code] = outflow
            changes.append(change)
            cells.append((f"{outflow:.0f}", f"{100 * change:+.1f} %", f"{chosen.index[-1]:.2f}"))
        difference = outflows[variant, OURS] / outflows[variant, LIGGGHTS] - 1.0
        both = [curves[variant][code]["above"].to_numpy() for code in CODES]
        worst.append(float(np.abs(both[0] - both[1]).max()) / setup.n_grains)
        rows.append((variant, f"{silo.beverloo_per_s(setup):.0f}", *cells[0], *cells[1], f"{100 * difference:+.1f} %"))
    head = (
        "orifice", "Beverloo (grains/s)", "virtual-soil", "its change", "until (s)", "LIGGGHTS", "its change", "until (s)",
        "difference",
    )  # fmt: skip
    first, second = (silo.SETUPS[variant] for variant in variants)
    expected = silo.beverloo_per_s(second) / silo.beverloo_per_s(first)
    ratios = {code: outflows[variants[1], code] / outflows[variants[0], code] for code in CODES}
    beside = [outflows[variant, code] / silo.beverloo_per_s(silo.SETUPS[variant]) - 1.0 for variant, code in outflows]
    ran = paragraph(
        f"Run: {first.n_grains} grains, E / {first.softening:g}, {first.duration_s:g} s, steps of {1e6 * first.time_step_s:g} µs.",
        "The benchmark's runs have 100 000 grains of full stiffness, for 5 s, with steps of 1.5 µs.",
    )
    found = paragraph(
        f"Within {100 * OUTFLOW_TOLERANCE:g} % of Beverloo, which is for flat bottoms: {holds_for(beside, OUTFLOW_TOLERANCE)}.",
        f"Constant within {100 * CHANGE_TOLERANCE:g} %: {holds_for(changes, CHANGE_TOLERANCE)}.",
        f"Ratio of the outflows, large to small: {ratios[OURS]:.2f} (virtual-soil), {ratios[LIGGGHTS]:.2f} (LIGGGHTS);",
        f"within {100 * RATIO_TOLERANCE:g} % of {expected:.2f}:",
        f"{holds_for([ratio / expected - 1.0 for ratio in ratios.values()], RATIO_TOLERANCE)}.",
        f"Largest differences of the grains above the orifice at any time: {', '.join(f'{100 * x:.2f} %' for x in worst)} of all",
        f"grains (tolerance {100 * COUNT_TOLERANCE:g} %: {verdict(max(worst) <= COUNT_TOLERANCE)}).",
    )
    return "\n".join([SILO, ran, FIGURE, markdown(head, rows), found]), figures.silo(curves)


def paragraph(*sentences: str) -> str:
    """Join and wrap text, with a line break at its end."""
    text = " ".join(sentence for sentence in sentences if sentence)
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False) + "\n"


def holds_for(deviations: list[float], tolerance: float) -> str:
    """Verdict on all deviations, with the largest if it does not hold."""
    largest = max(deviations, key=abs)
    return verdict(abs(largest) <= tolerance) + ("" if abs(largest) <= tolerance else f" (up to {100 * largest:+.1f} %)")


def verdict(holds: bool) -> str:
    """Word for a check."""
    return "holds" if holds else "**does not hold**"


def not_run(results: Results) -> str:
    """What the benchmark has and this page does not, with the cost of what the settings offer, at the measured speeds."""
    missing = ["the impact on 100 000 grains, of which no packing is published", "the silo with M2"]
    missing += [f"the {case} (`bulk.cases`)" for case in CASES if not results.variants(case)]
    offered: list[tuple[str, str, str, int, drum.Setup | silo.Setup]] = []
    for n_grains in impact.DURATIONS_S:
        if f"{n_grains}_0" not in results.variants("impact"):
            missing.append(f"the impact on {n_grains} grains (`bulk.impact_grains`)")
    if "soft_0" in results.variants("drum"):
        hard = drum.SETUPS["hard_0"]
        offered.append(("each drum at full stiffness (`bulk.drum: hard`)", "drum", DRUM_BEGINNING, 38_000, hard))
    if "small" in results.variants("silo"):
        full = silo.SETUPS["large_full"]
        offered.append(("each silo in full (`bulk.silo: full`)", "silo", "large", full.n_grains, full))
    for text, case, variant, n_grains, setup in offered:
        hours = []
        for code in CODES:
            cost = results.cost(case, code, variant)
            steps = setup.duration_s / setup.time_step_s
            hours.append(steps * n_grains * cost["processor_s"] / cost["grain_steps"] / SECONDS_PER_HOUR)
        missing.append(f"{text}, at the speeds above {hours[0]:.0f} h in virtual-soil and {hours[1]:.0f} h in LIGGGHTS")
    return "## Not run\n\n" + "\n".join(f"- {text}" for text in missing) + "\n"
