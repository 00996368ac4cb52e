"""The page of target `wheel_spread`: noise of beds, spread of soils, what the calibration leaves and what would narrow it."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from virtual_soil.calibration.further import further_error, halving_error, left_over
from virtual_soil.calibration.space import Space, inside_hull
from virtual_soil.calibration.uncertainty import LEVELS
from virtual_soil.campaign.experiments.registry import RESPONSES
from virtual_soil.campaign.files import write_text, writing
from virtual_soil.verification.page import markdown
from virtual_soil.wheel.figures import COLOURS, DPI
from virtual_soil.wheel.soil import is_confirmed
from virtual_soil.wheel.spread import Emulator, components, emulator

#: Column of the runs -> what it is called, unit of the page and factor to it.
QUANTITIES = {
    "drawbar_pull_n": ("drawbar pull", "N", 1.0),
    "drawbar_ratio": ("drawbar pull over load", "1", 1.0),
    "torque_n_m": ("torque", "N m", 1.0),
    "sinkage_m": ("sinkage", "mm", 1e3),
}
#: What the verdict is about.
MAIN = "drawbar_pull_n"
#: Further measurements from the runs: name, their column in the runs, what they are called, and their unit.
OF_RUNS = {
    "plate_pressure_pa": ("plate_pressure_pa", "pressure under the plate", "Pa"),
    "bed_bulk_density_kg_m3": ("bulk_density_kg_m3", "bulk density of the bed", "kg/m3"),
}
#: Posterior samples that are looked for in the soils' hull.
N_HULL = 200


@dataclass(frozen=True)
class Family:
    """Soils of one case and what is known of them.

    soils : one row per soil in the order of their first runs: case (its name), values of the design's variables. posterior :
    samples of the case. space : of the design. acting : variables that act under the wheel. responses : column -> unit, and
    smallest difference of consequence.
    """

    case: str
    verdicts: list[str]
    soils: pd.DataFrame
    posterior: pd.DataFrame
    space: Space
    acting: list[str]
    responses: dict[str, tuple[str, float]]

    def unit(self, table: pd.DataFrame) -> np.ndarray:
        """Coordinates (m, k) of what acts under the wheel."""
        columns = [self.space.variables.index(name) for name in self.acting]
        return self.space.unit({name: table[name].to_numpy() for name in self.space.variables})[:, columns]


def emulated(runs: pd.DataFrame, family: Family, column: str) -> tuple[Emulator, np.ndarray]:
    """Emulator of a column of the runs over the soils, and its values over the posterior."""
    groups = runs.groupby("case")[column]
    means, n_beds = groups.mean()[family.soils["case"]], groups.count()[family.soils["case"]]
    model = emulator(family.unit(family.soils), means.to_numpy(), n_beds.to_numpy())
    return model, model.predict(family.unit(family.posterior))


def answer_table(runs: pd.DataFrame, family: Family) -> pd.DataFrame:
    """One row per quantity: standard deviations of beds and soils, the emulator, and its values over the posterior.

    runs : those that are done, of schema wheel_spread.
    """
    rows = []
    for column in QUANTITIES:
        found = components(runs[column], runs["case"])
        model, values = emulated(runs, family, column)
        if model.degree == 0:  # the soils' mean: it knows nothing of the posterior
            values = np.full(len(values), math.nan)
        low, high = np.quantile(values, LEVELS)
        row = {"case": family.case, "quantity": column, **vars(found), "emulator_degree": model.degree}
        row |= {"emulator_error": model.loo_rmse, "posterior_mean": float(values.mean())}
        row |= {"posterior_sd": float(values.std(ddof=1)), "posterior_low_95": float(low), "posterior_high_95": float(high)}
        rows.append(row | {"posterior_in_hull_ratio": in_hull(family)})
    return pd.DataFrame(rows)


def in_hull(family: Family) -> float:
    """Share of the posterior that the soils surround: elsewhere the emulator extrapolates."""
    points, samples = family.unit(family.soils), family.unit(family.posterior)
    step = max(len(samples) // N_HULL, 1)
    return float(np.mean([inside_hull(points, sample) for sample in samples[::step]]))


def further_table(runs: pd.DataFrame, family: Family, measured_ratio: float) -> pd.DataFrame:
    """One row per further measurement: which share of the standard deviation of MAIN over the posterior it would leave.

    measured_ratio : standard uncertainty of a measurement over its mean; that of an emulated one has the emulator's error, too.
    Missing where no emulator knows how the quantity depends on the soil.
    """
    main, values = emulated(runs, family, MAIN)
    rows = []
    for column, (unit, consequence) in family.responses.items():
        known = family.posterior[column]
        error = further_error(known, measured_ratio, consequence)
        rows.append((column, unit, known.mean(), error, left_over(values, known, error), halving_error(values, known)))
    for name, (column, _, unit) in OF_RUNS.items():
        if runs[column].notna().all():
            model, known = emulated(runs, family, column)
            error = float(np.hypot(measured_ratio * abs(known.mean()), model.loo_rmse))
            rows.append(
                (name, unit, known.mean(), error, left_over(values, known, error), halving_error(values, known, model.loo_rmse))
            )
    table = pd.DataFrame(rows, columns=["measurement", "unit", "mean", "standard_error", "left_over_ratio", "halving_error"])
    if main.degree == 0:
        table["left_over_ratio"] = math.nan
    return table.assign(case=family.case).sort_values("left_over_ratio", ignore_index=True)


def verdict(answer: pd.Series, further: pd.DataFrame) -> str:
    """The answer in words, for one row of `answer_table`."""
    name, unit, factor = QUANTITIES[answer["quantity"]]
    beds, soils, rest = (factor * answer[key] for key in ("beds_sd", "soils_sd", "posterior_sd"))
    text = f"{name.capitalize()} = {factor * answer['mean']:.2f} ± {beds:.2f} (bed) ± {soils:.2f} {unit} (soil). "
    if answer["soils_low"] == 0.0:
        text += "With these runs the soils cannot be told from the beds' noise: it does not matter, or too few were run. "
    elif answer["soils_low"] > answer["beds_high"]:
        text += "**It matters which of the equivalent soils is taken**: they differ by more than beds of one soil do. "
    else:
        text += "The soils differ, and not clearly more than the beds of one soil. "
    if answer["emulator_degree"] == 0:
        return text + (
            "No polynomial in the grains' parameters predicts soils left out better than the mean does: what the whole posterior "
            "has, and what would narrow it, is not known from these soils."
        )
    text += f"Over the whole posterior the calibration leaves ± {rest:.2f} {unit}. "
    halving = further[further["left_over_ratio"] <= 0.5]
    best = further.iloc[0]
    left = f"{called(best)} as well would leave {best['left_over_ratio']:.2f} of it."
    return text + (f"Measuring {left}" if len(halving) else f"No further measurement would halve it: {left}")


def beds_in_words(runs: pd.DataFrame) -> tuple[str, str]:
    """Number of beds of a soil, and their mean bulk density."""
    return f"{len(runs)}", f"{runs['bulk_density_kg_m3'].mean():.0f}"


def or_dash(value: float, form: str) -> str:
    """A number of the table; a dash if it is missing."""
    return "–" if pd.isna(value) else f"{value:{form}}"


def halves(measurement: dict) -> str:
    """Standard uncertainty with which a measurement halves the uncertainty, as the table has it."""
    return "–" if pd.isna(measurement["halving_error"]) else f"± {measurement['halving_error']:.2g}"


def called(measurement: pd.Series) -> str:
    """A measurement and its standard uncertainty in words."""
    names = {response.column: response.words for response in RESPONSES.values()} | {
        name: said for name, (_, said, _) in OF_RUNS.items()
    }
    name = names[measurement["measurement"]]
    return f"{name} to ± {measurement['standard_error']:.3g} {measurement['unit']}"


def figure(runs: pd.DataFrame, family: Family) -> Figure:
    """Draw each soil's runs and their mean; and what the emulator makes of the posterior."""
    name, unit, factor = QUANTITIES[MAIN]
    drawn = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = drawn.subplots(1, 2, sharey=True, width_ratios=(2, 1))
    for k, soil in enumerate(family.soils["case"]):
        here = runs[runs["case"] == soil]
        left.errorbar([k] * len(here), factor * here[MAIN], factor * here["drawbar_pull_error_n"], fmt="o", color=COLOURS[k > 0])
        left.plot([k - 0.3, k + 0.3], [factor * here[MAIN].mean()] * 2, color=COLOURS[k > 0])
    labels = ["optimum", *(str(soil).rpartition("-")[2] for soil in family.soils["case"][1:])]
    left.set_xticks(range(len(labels)), labels)
    left.set(xlabel="soil: rank of the equivalent set", ylabel=f"{name} ({unit})")
    model, values = emulated(runs, family, MAIN)
    if model.degree:
        right.hist(factor * values, bins=30, orientation="horizontal", color=COLOURS[2])
    else:
        right.text(0.5, 0.5, "not known", transform=right.transAxes, ha="center")
    right.set_xlabel("posterior samples, by the emulator")
    return drawn


def write_page(runs: pd.DataFrame, family: Family, answers: pd.DataFrame, further: pd.DataFrame, page: Path, picture: Path) -> None:
    """Write the page (Markdown) and its figure, next to or below the page's folder."""
    row = runs.iloc[0]
    confirmed = "confirmed" if is_confirmed(family.verdicts) else "**not confirmed**"
    lines = [
        f"The answer of case {family.case} is {confirmed} by simulation.",
        "# Does it matter which of the equivalent soils is taken?",
        f"Wheel of radius {1e3 * row['radius_m']:.4g} mm under {row['applied_load_n']:.4g} N at slip {row['asked_slip']:g}: "
        f"{runs['case'].nunique()} soils that serve the calibration as well, {len(runs)} runs, each on a bed of its own. "
        "Standard deviations with 95 % intervals; `virtual_soil.wheel.spread` has the method.",
        verdict(answers[answers["quantity"] == MAIN].iloc[0], further),
        f"![{MAIN}]({picture.relative_to(page.parent).as_posix()})",
        answers_markdown(answers),
        f"The soils surround {100 * answers['posterior_in_hull_ratio'].iloc[0]:.0f} % of the posterior; elsewhere the emulator "
        "extrapolates. Its error is that at soils left out.",
        "## What would narrow it",
        "Share of the standard deviation of the drawbar pull over the posterior that a further measurement would leave.",
        markdown(
            ("measurement", "unit", "mean", "standard uncertainty", "left over", "halves it if known to"),
            [
                (
                    r["measurement"],
                    r["unit"],
                    *(f"{r[key]:.4g}" for key in ("mean", "standard_error")),
                    or_dash(r["left_over_ratio"], ".2f"),
                    halves(r),
                )
                for r in further.to_dict("records")
            ],
        ),
        "## Soils",
        "A soil that does not pack to the asked bulk density has the nearest one that it reaches.",
        markdown(
            ("soil", "beds", "bulk density of the beds (kg/m³)", *family.space.variables),
            [
                (r["case"], *beds_in_words(runs[runs["case"] == r["case"]]), *(f"{r[name]:.4g}" for name in family.space.variables))
                for r in family.soils.to_dict("records")
            ],
        ),
    ]
    with writing(picture):
        picture.parent.mkdir(parents=True, exist_ok=True)
        figure(runs, family).savefig(picture, dpi=DPI, metadata={"Software": None})
    write_text(page, "\n\n".join(line.strip() for line in lines) + "\n")


def answers_markdown(answers: pd.DataFrame) -> str:
    """Table of all quantities."""
    rows = []
    for row in answers.to_dict("records"):
        name, unit, f = QUANTITIES[row["quantity"]]
        beds, soils = (
            f"{f * row[f'{k}_sd']:.3g} ({f * row[f'{k}_low']:.3g} to {f * row[f'{k}_high']:.3g})" for k in ("beds", "soils")
        )
        known = not pd.isna(row["posterior_sd"])
        left = f"{f * row['posterior_mean']:.3g} ± {f * row['posterior_sd']:.2g}" if known else "–"
        interval = f"{f * row['posterior_low_95']:.3g} to {f * row['posterior_high_95']:.3g}" if known else "–"
        rows.append((name, unit, f"{f * row['mean']:.4g}", beds, soils, left, interval, f"{f * row['emulator_error']:.2g}"))
    return markdown(("", "unit", "mean", "SD of beds", "SD of soils", "over the posterior", "95 %", "emulator's error"), rows)
