"""The page of wheel, plates and cone, written from their tables; its first line says whether the soil's answer is confirmed."""

from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from virtual_soil.campaign.experiments.common import LARGEST_OVERLAP_RATIO
from virtual_soil.campaign.files import write_text, writing
from virtual_soil.verification.page import markdown
from virtual_soil.wheel import contact_figures, figures
from virtual_soil.wheel.measured_page import handbook_section, measured_section
from virtual_soil.wheel.setups import BETWEEN_WARNINGS
from virtual_soil.wheel.soil import is_confirmed

#: Runs whose balance of momentum is worse than this are named.
LARGEST_RESIDUAL = 1e-5
#: Beds may differ by this share from the bulk density that was asked for; it is found on columns, to half a hundredth.
DENSITY_TOLERANCE = 0.015


#: Name of a figure -> what it shows, for those who do not see it.
SHOWN = {
    "wheel": "Drawbar pull over load, torque over load and radius, sinkage, and efficiency against slip",
    "wheel_over_time": "Drawbar pull and sinkage over time",
    "rim": "Normal and shear stress along the rim",
    "rut": "Map of the rut behind the wheel, and its depth along the middle",
    "field": "Displacement and velocity of the grains in the wheel's middle plane",
    "plate": "Pressure under the plates against sinkage",
    "cone": "Resistance of the cone against depth",
}


@dataclass(frozen=True)
class Results:
    """Tables by tool ("wheel", "plate", "cone"; those that were run), runs and histories one by one.

    verdicts : case -> prediction and match of its answer. measured : of schema wheel_measured, handbook : of schema wheel_handbook,
    if there are any. sources : of the measurements. asked_density_kg_m3 : bulk density that was asked for, if one was.
    soils : case -> keys and values of its grains under the wheel. engine : settings of the engine.
    fields : "rim", "rut", "field" -> tables of the wheel's runs one by one.
    """

    verdicts: dict[str, list[str]]
    tables: dict[str, pd.DataFrame]
    runs: dict[str, pd.DataFrame]
    histories: dict[str, list[pd.DataFrame]] = field(default_factory=dict)
    measured: pd.DataFrame | None = None
    handbook: pd.DataFrame | None = None
    sources: tuple[str, ...] = ()
    asked_density_kg_m3: float | None = None
    soils: dict[str, dict] = field(default_factory=dict)
    engine: dict = field(default_factory=dict)
    fields: dict[str, list[pd.DataFrame]] = field(default_factory=dict)


def write_page(results: Results, page: Path, folder: Path) -> None:
    """Write the page (Markdown) and its figures into a folder next to or below the page's."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    parts = [first_line(results.verdicts), "# Wheel, plates and cone on the calibrated soil", assumptions(results.tables["wheel"])]
    parts += [density(results.tables["wheel"], results.asked_density_kg_m3)]
    parts += wheel_section(results, page, folder)
    if results.handbook is not None:
        parts += [handbook_section(results.handbook)]
    if results.measured is not None:
        parts += [measured_section(results.measured, results.sources)]
    parts += under_the_wheel(results, page, folder)
    for tool, section in (("plate", plate_table), ("cone", cone_table)):
        if tool in results.tables:
            drawn = figures.pressed(results.runs[tool], results.histories[tool], tool, results.measured)
            parts += [f"## {tool.capitalize()}", linked(drawn, tool, page, folder), section(results.tables[tool])]
            parts += [softness(results.tables[tool]), warned(results.tables[tool])]
    parts += soil_card(results.soils, results.engine)
    write_text(page, "\n\n".join(part.strip() for part in parts if part) + "\n")


def linked(figure: Figure, name: str, page: Path, folder: Path) -> str:
    """Save a figure; returns the link to it."""
    with writing(folder / f"{name}.png"):
        figure.savefig(folder / f"{name}.png", dpi=figures.DPI, metadata={"Software": None})
    return f"![{SHOWN[name]}]({(folder / f'{name}.png').relative_to(page.parent).as_posix()})"


def soil_card(soils: dict[str, dict], engine: dict) -> list[str]:
    """What the grains under the tools are, by the keys of the configuration, and how they were simulated."""
    if not soils:
        return []
    keys = list(dict.fromkeys(key for values in soils.values() for key in values))
    rows = [(f"`{key}`", *(shown(values.get(key)) for values in soils.values())) for key in keys]
    settings = [(f"`engine.{key}`", *[shown(value)] * len(soils)) for key, value in engine.items()]
    return ["## Soil card", markdown(("key", *soils), [*rows, *settings])]


def shown(value) -> str:
    """A setting in a table."""
    return f"{value:.6g}" if isinstance(value, float) else "–" if value is None else str(value)


def first_line(verdicts: dict[str, list[str]]) -> str:
    """Whether the answers that the tools ran on are confirmed."""
    said = {case: f"prediction {prediction}, match {match}" for case, (prediction, match) in verdicts.items()}
    doubtful = [case for case, found in verdicts.items() if not is_confirmed(found)]
    if not doubtful:
        return f"The soil's answer is confirmed by simulation and matches its targets: {', '.join(verdicts)}."
    return "**The soil's answer is not confirmed**: " + "; ".join(f"{case}: {said[case]}" for case in doubtful) + "."


def assumptions(table: pd.DataFrame) -> str:
    """What the results depend on besides the soil."""
    row = table.iloc[0]
    size = f"radius {1e3 * row['radius_m']:.4g} mm and width {1e3 * row['width_m']:.4g} mm"
    low, high = table["solid_fraction"].min(), table["solid_fraction"].max()
    lined = ", on its sides alone: grains of the soil are glued to the rim" if row["rim"] == "sandpaper" else ""
    text = (
        f"Wheel of {size} under {row['applied_load_n']:.4g} N; grains of mean radius {1e3 * row['grain_radius_m']:.3g} mm with "
        "the frictions of the calibrated ones; static and rolling friction of grains on the wheel "
        f"{row['wheel_static_friction']:g} and {row['wheel_rolling_friction']:.3g}, which nobody measured{lined}; "
        f"solid fraction of the beds {low:.3f} to {high:.3f}. "
        "Forces are those of the soil on the wheel. Each ± is the standard error of one run's means over the last 40 % of its "
        "travel: neither the scatter of beds, which their points show, nor the calibration's uncertainty, nor that of grain size "
        "and speed."
    )
    return f"{text}\n\n{warned(table)}"


def density(table: pd.DataFrame, asked_kg_m3: float | None) -> str:
    """Bulk density of the beds beside the one that was asked for, if one was."""
    low, high = table["bulk_density_kg_m3"].min(), table["bulk_density_kg_m3"].max()
    text = f"Bulk density of the beds {low:.0f} to {high:.0f} kg/m³"
    if asked_kg_m3 is None:
        return f"{text}."
    off = max(abs(low / asked_kg_m3 - 1.0), abs(high / asked_kg_m3 - 1.0))
    said = f"asked for {asked_kg_m3:.0f} kg/m³"
    return f"{text}, {said}." if off <= DENSITY_TOLERANCE else f"{text}, **{said}: off by {100 * off:.1f} %**."


def warned(table: pd.DataFrame) -> str:
    """Warnings of the runs, each once."""
    return "\n".join(
        sorted({f"- {warning}" for found in table["warnings"] for warning in found.split(BETWEEN_WARNINGS) if warning})
    )


def wheel_section(results: Results, page: Path, folder: Path) -> list[str]:
    """Figures and table of the wheel."""
    table = results.tables["wheel"]
    parts = ["## Wheel", linked(figures.against_slip(table, results.measured, results.handbook), "wheel", page, folder)]
    parts += [linked(figures.over_time(results.runs["wheel"], results.histories["wheel"]), "wheel_over_time", page, folder)]
    return [*parts, wheel_table(table), remarks(table), softness(table)]


def under_the_wheel(results: Results, page: Path, folder: Path) -> list[str]:
    """Figures of the stresses along the rim, the rut and the flow."""
    if not results.fields:
        return []
    runs, histories, tables = results.runs["wheel"], results.histories["wheel"], results.fields
    return [
        "## Under the wheel",
        "Stresses of the soil along the rim, means over the steady stretch with their standard errors: normal ones towards the "
        "axle, shear positive where it resists a driven wheel.",
        linked(contact_figures.along_rim(runs, tables["rim"]), "rim", page, folder),
        "The rut: change of the surface's height behind the wheel, and along its middle with the place of the axle (dotted); bands "
        "are the standard deviation of the cells.",
        linked(contact_figures.rut(runs, histories, tables["rut"]), "rut", page, folder),
        "Grains in the wheel's middle plane in the middle of the steady stretch: displacement since the bed was at rest (colour), "
        "and velocity (arrows).",
        linked(contact_figures.field(runs, tables["field"]), "field", page, folder),
    ]


def pair(row, name: str, error: str, digits: int, factor: float = 1.0) -> str:
    """A value with its standard error."""
    if pd.isna(row[name]):
        return "–"
    return f"{factor * row[name]:.{digits}f} ± {factor * row[error]:.{digits}f}"


def wheel_table(table: pd.DataFrame) -> str:
    """One line per run."""
    head = (
        *("case", "bed", "slip", "status", "F_DP (N)", "F_DP/W", "T (N m)", "T/(W R)", "sinkage (mm)", "load carried (N)"),
        *("efficiency", "largest overlap"),
    )
    rows = []
    for row in table.to_dict("records"):
        pulls = row["drawbar_pull_n"] > 0.0 and row["torque_n_m"] > 0.0
        rows.append(
            (
                *(row["case"], row["seed"], "free" if pd.isna(row["asked_slip"]) else f"{row['asked_slip']:g}", row["status"]),
                pair(row, "drawbar_pull_n", "drawbar_pull_error_n", 2),
                pair(row, "drawbar_ratio", "drawbar_ratio_error", 3),
                pair(row, "torque_n_m", "torque_error_n_m", 4),
                pair(row, "traction_coefficient", "traction_coefficient_error", 3),
                pair(row, "sinkage_m", "sinkage_error_m", 2, 1e3),
                pair(row, "load_n", "load_error_n", 2),
                pair(row, "efficiency", "efficiency_error", 3) if pulls else "–",
                f"{100 * row['max_overlap_ratio']:.1f} %",
            )
        )
    return markdown(head, rows)


def softness(table: pd.DataFrame) -> str:
    """Says whether grains overlap more than a study allows; stiffer ones are `wheel.shear_modulus_pa`."""
    largest = float(table["max_overlap_ratio"].max())
    if not largest > LARGEST_OVERLAP_RATIO:
        return ""
    limit = f"{100 * LARGEST_OVERLAP_RATIO:g} %"
    return f"Grains overlap by up to {100 * largest:.2g} % of a radius, more than {limit}: too soft (`wheel.shear_modulus_pa`)."


def remarks(table: pd.DataFrame) -> str:
    """Runs that were not done, are not steady, or do not balance."""
    lines = []
    for row in table.to_dict("records"):
        where = f"{row['case']}, bed {row['seed']}, slip " + ("free" if pd.isna(row["asked_slip"]) else f"{row['asked_slip']:g}")
        if row["status"] != "done":
            lines.append(f"- {where}: {row['status']}" + (f" ({row['reason']})" if row["reason"] else ""))
            continue
        if abs(row["sinkage_drift_m"]) > 5.0 * row["sinkage_error_m"]:
            lines.append(f"- {where}: not steady, the wheel still sank by {1e3 * row['sinkage_drift_m']:.2f} mm over the stretch")
        if row["momentum_residual_ratio"] > LARGEST_RESIDUAL:
            lines.append(f"- {where}: the momentum misses {row['momentum_residual_ratio']:.1e} of load times duration")
        if row["power_balance_w"] < -2.0 * row["power_balance_error_w"]:
            lines.append(f"- {where}: the wheel pulls with more power than its motor gives ({row['power_balance_w']:.3g} W)")
    return "\n".join(lines) or "All runs are done, steady, and balance."


def plate_table(table: pd.DataFrame) -> str:
    """One line per plate: pressures, law; and Bekker's moduli per bed."""
    sinkages = sorted(set(table["sinkage_m"]))
    head = ("case", "bed", "plate (mm)", *(f"kPa at {1e3 * z:.3g} mm" for z in sinkages), "k (Pa/mⁿ)", "n")
    rows = []
    for (case, seed, diameter), group in table.groupby(["case", "seed", "diameter_m"]):
        at = [f"{pressure / 1e3:.2f}" if pd.notna(pressure) else "–" for pressure in group.sort_values("sinkage_m")["pressure_pa"]]
        law = group.iloc[0]
        rows.append((case, seed, f"{1e3 * diameter:.3g}", *at, f"{law['k_pa_m_n']:.3g}", f"{law['n']:.2f}"))
    beds = table.drop_duplicates(["case", "seed"]).dropna(subset=["bekker_n"])
    moduli = [
        f"- {row['case']}, bed {row['seed']}: n = {row['bekker_n']:.2f}, k_c = {row['bekker_k_c']:.3g}, "
        f"k_phi = {row['bekker_k_phi']:.3g} (SI, with n)"
        for row in beds.to_dict("records")
    ]
    return "\n".join([markdown(head, rows), *(["Bekker's moduli:", "", *moduli] if moduli else [])])


def cone_table(table: pd.DataFrame) -> str:
    """One line per bed."""
    head = ("case", "bed", "gradient between 10 and 30 % of the depth (kPa/mm)", "resistance (kPa)", "at (mm)")
    rows = [
        (
            *(row["case"], row["seed"], pair(row, "gradient_pa_m", "gradient_error_pa_m", 3, 1e-6)),
            *(pair(row, "resistance_pa", "resistance_error_pa", 2, 1e-3), f"{1e3 * row['resistance_depth_m']:.3g}"),
        )
        for row in table.to_dict("records")
    ]
    return markdown(head, rows)
