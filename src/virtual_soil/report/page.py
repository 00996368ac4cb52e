"""The report: reads the tables of a finished study and fills the page's template."""

import base64
import json
from dataclasses import dataclass
from pathlib import Path

import jinja2
import numpy as np
import pandas as pd
import plotly
import yaml
from plotly.offline import get_plotlyjs

from virtual_soil.calibration import paper
from virtual_soil.calibration.paper import published
from virtual_soil.calibration.surrogate import RESPONSES
from virtual_soil.campaign.inference import read_models
from virtual_soil.campaign.stored import stored
from virtual_soil.campaign.study import experiment_settings
from virtual_soil.campaign.tables import read_provenance, read_table
from virtual_soil.report import calibrated, pack, plots, views
from virtual_soil.report import figures as drawn
from virtual_soil.report.contents import FIGURES, TABLES, caption, has_friction_grid
from virtual_soil.report.text import number, with_error

TEMPLATES = Path(__file__).resolve().parent
#: Heaps at Table 2's points should come this near to EDEM's.
EDEM_TOLERANCE_DEG = 2.5

#: Whose surrogates an optimum was found on.
SOURCES = {"ours": "ours", "polynomial": "f·g on our simulations", "published": "published f·g"}
ASSUMPTIONS = (
    "Equal spheres unless a spread of radii is configured; the paper does not say.",
    "Tube, plate and the shear box's plates have the friction and stiffness of the grains; the box's side walls are smooth.",
    "Grains that touch floor and lid of the shear box are glued to them, like toothed plates.",
    "Shear specimens are prepared with reduced friction (tamped), heaps are poured with full friction.",
    "In the radius sweep the geometry grows with the grains unless configured otherwise; the lift speed stays.",
    "Strength is the plateau, and normal stress that on the shear plane, unless configured otherwise.",
    "The paper's Equation 3 is read with c in kPa and r0 = 200 µm for the shear test: only then does it give the printed values.",
)


@dataclass(frozen=True)
class Study:
    """All that the report reads: tables by name, surrogates, stored grains and curves of every simulation."""

    config: dict
    tables: dict[str, pd.DataFrame]
    every: dict[str, pd.DataFrame]  # repose, shear and strength of the campaign, the rounds and the verification
    models: dict[str, dict]
    rounds: list[pd.DataFrame]
    residuals: pd.DataFrame
    twins: pd.DataFrame | None
    states: dict[str, tuple[pd.DataFrame, pd.DataFrame]]
    histories: dict[str, pd.DataFrame]
    frames: pd.DataFrame
    engine: str


@dataclass(frozen=True)
class Report:
    """The page, and what stands in it as files of their own: SVG of each figure, the table behind it, each table."""

    html: str
    figures: dict[str, str]
    data: dict[str, pd.DataFrame]
    tables: dict[str, pd.DataFrame]


def read_study(files, config: dict) -> Study:
    """Read the rule's input."""
    tables = {Path(path).stem: read_table(path, Path(path).stem) for path in files.tables}
    heaps, boxes = (stored(paths, "grains") for paths in (files.heaps, files.after))
    before = stored([*files.filled, *files.before], "grains")
    later = {"repose": files.later_repose, "shear": files.later_shear, "strength": files.later_strength}
    return Study(
        config=config,
        tables=tables,
        every={name: pd.concat([tables[name], *(read_table(path, name) for path in paths)]) for name, paths in later.items()},
        models={kind: read_models(files.surrogates, kind) for kind in ("chosen", "quadratic", "gaussian_process")},
        rounds=[read_table(path, "verification") for path in files.rounds],
        residuals=read_table(files.residuals, "residuals"),
        twins=read_table(files.twins[0], "twins") if files.twins else None,
        states={name: (before[name], after) for name, after in (heaps | boxes).items()},
        histories=stored(files.histories, "shear_history"),
        frames=read_table(files.lift, "lift"),
        engine=read_provenance(files.heaps[0]).get("engine", "unknown"),
    )


def build(study: Study, versions: dict) -> Report:
    """The report on a finished study."""
    items, tables = figures_of(study), tables_of(study)
    figures = {name: plots.svg(item.figure) for name, item in items.items()}
    # a figure's data are the same bytes in every run, and no figure shows how long a simulation took
    data = {name: item.data.drop(columns="wall_time_s", errors="ignore") for name, item in items.items()}
    shown, grains, grains_note = views_of(study)
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(TEMPLATES), autoescape=True, trim_blocks=True)
    html = environment.get_template("template.html.j2").render(
        study=study.config["study"],
        cost=cost_sentence(study.every),
        cards=calibrated.answer_cards(study.tables["calibration"]),
        answer_remarks=calibrated.answer_remarks(study.tables),
        reach_remarks=calibrated.reach_remarks(study.tables["reachability"]),
        screening_remarks=screening_remarks(study.tables["screening"], study.config),
        fit_remarks=calibrated.fit_remarks(study.tables, study.models["chosen"]),
        gaps=calibrated.gap_table(study.rounds, study.tables["verification"]) if study.rounds else None,
        coverage=calibrated.coverage_sentence(study.tables["coverage"]),
        twins=calibrated.twin_table(study.twins),
        acceleration_remarks=acceleration_remarks(study.tables["acceleration"]),
        failed=failed_table(study.every),
        tables={name: {"frame": frame, "caption": caption(name)} for name, frame in tables.items()},
        figures={
            name: {
                "title": FIGURES[name][1],
                "caption": caption(name),
                "alt": items[name].alt,
                "image": base64.b64encode(text.encode()).decode(),
            }
            for name, text in figures.items()
        },
        grains_note=grains_note,
        assumptions=ASSUMPTIONS,
        versions={**versions, "plotly": plotly.__version__},
        engine=study.engine,
        configuration=yaml.safe_dump(study.config, sort_keys=False),
        plotly=pack.packed_bytes(get_plotlyjs().encode()),
        views=pack.packed_json(shown),
        grains=embedded_json(grains),
        csv=embedded_json({name: pack.packed_bytes(csv(table).encode()) for name, table in data.items()}),
    )
    return Report(html, figures, data, tables)


def csv(table: pd.DataFrame) -> str:
    """A table as CSV."""
    return table.to_csv(index=False, float_format="%.6g", lineterminator="\n")


def embedded_json(value) -> str:
    """JSON that may stand in a script element."""
    return json.dumps(value, separators=(",", ":")).replace("<", "\\u003c")


def figures_of(study: Study) -> dict[str, drawn.Item]:
    """Every figure, in the order of the report's contents."""
    config, tables, chosen = study.config, study.tables, study.models["chosen"]
    items = drawn.experiment_figures(config, tables, study.states, study.histories, study.frames) | drawn.iteration_figure(tables)
    if has_friction_grid(config):
        items |= drawn.response_figures(config, tables, chosen, study.models["quadratic"])
        items |= drawn.inference_figures(config, tables, chosen, study.residuals)
    return {name: items[name] for name in FIGURES if name in items}


def tables_of(study: Study) -> dict[str, pd.DataFrame]:
    """Every table, in the order of the report's contents."""
    tables, models = study.tables, study.models
    made = {
        "answer": calibrated.answer_table(tables["calibration"]),
        "properties": calibrated.properties_table(tables["verification"]),
        "soils": soil_table(tables["soil"]),
        "reachability": calibrated.reachability_table(tables["reachability"]),
        "screening": screening_table(tables["screening"]),
        "equation": equation_table(models["quadratic"]),
        "quality": calibrated.quality_table({kind: models[kind] for kind in ("quadratic", "gaussian_process")}),
        "sensitivity": calibrated.sensitivity_table(tables["sensitivity"]),
        "optimisation": optimisation_table(tables["calibration"]),
        "minima": calibrated.minima_table(tables["minima"]),
        "identifiability": calibrated.identifiability_table(tables["identifiability"]),
        "verification": calibrated.verification_table(tables["verification"]),
        "acceleration": acceleration_table(tables["acceleration"]),
    }
    return {name: made[name] for name in TABLES}


def views_of(study: Study) -> tuple[dict, dict, str]:
    """Data of the interactive views, the grains of the 3D views, and a sentence on the simulations that these offer."""
    config, tables = study.config, study.tables
    columns = [name for name in study.every["repose"] if name in study.every["shear"]]
    rows = pd.concat([study.every[name][columns] for name in ("repose", "shear")])
    rows = rows.drop_duplicates(["simulation_id", "point_id"])
    rows = views.labelled(rows, config["material"], tables["calibration"])
    setups = {row["simulation_id"]: experiment_settings(config, row)["setup"] for _, row in rows.iterrows()}
    periods = {name: setup["width_ratio"] * setup["scale_radius_m"] for name, setup in setups.items() if "width_ratio" in setup}
    tests, note = views.grain_view(rows, study.states, periods)
    shown = {"shear": views.shear_view(rows, study.histories)}
    if has_friction_grid(config):
        radii = views.shown_radii(config["design"], tables["calibration"])
        kinds = {"ours": study.models["chosen"], "polynomial": study.models["quadratic"], "published": published()}
        points = {response: drawn.known_points(study.every, response) for response in RESPONSES}
        shown["surfaces"] = views.surface_view(kinds, radii, points)
        shown["iso"] = views.iso_view(tables["calibration"], tables["posterior"], tables["equivalents"], radii)
    return shown, {"tests": tests, "lift": views.lift_view(study.frames)}, note


def cost_sentence(tables) -> str:
    """How much was simulated."""
    runs = pd.concat([tables["repose"], tables["shear"]]).drop_duplicates("simulation_id")
    steps = float((runs["n_steps"] * runs["n_particles"]).sum())
    minutes = runs["wall_time_s"].sum() / 60.0
    n_heaps = (runs["experiment"] == "repose").sum()
    return f"{n_heaps} heaps and {len(runs) - n_heaps} shear tests: {steps:.2g} grain-steps in {minutes:.1f} core-minutes."


def soil_table(soils: pd.DataFrame) -> pd.DataFrame:
    """Table 1."""
    return pd.DataFrame(
        {
            "soil": soils["soil"],
            "property": soils["property"].str.replace("_", " "),
            "value": [
                f"{with_error(v, u)} {unit}"
                for v, u, unit in zip(soils["value"], soils["standard_uncertainty"], soils["unit"], strict=True)
            ],
            "method": soils["method"],
            "source": soils["source"],
        }
    )


def screening_table(table: pd.DataFrame) -> pd.DataFrame:
    """Table 2, ours beside the paper's."""
    return pd.DataFrame(
        {
            "parameter": table["parameter"],
            "changed to": ["base set" if pd.isna(v) else f"{v:g}" for v in table["changed_value"]],
            "A (°)": [with_error(a, s, 2) for a, s in zip(table["angle_of_repose_deg"], table["sd_deg"], strict=True)],
            "runs": table["n_runs"],
            "paper's A (°)": [with_error(a, s, 2) for a, s in zip(table["paper_angle_deg"], table["paper_sd_deg"], strict=True)],
            "ours − paper (°)": [number(v, 2) for v in table["angle_of_repose_deg"] - table["paper_angle_deg"]],
            "sensitivity (%)": [number(v) for v in table["sensitivity_percent"]],
            "paper's (%)": [number(v) for v in table["paper_sensitivity_percent"]],
            "beyond noise": np.where(table["exceeds_noise"], "yes", "no"),
        }
    )


def screening_remarks(table: pd.DataFrame, config: dict) -> list[str]:
    """Points that are far from EDEM's, and what matters."""
    remarks = []
    difference = table["angle_of_repose_deg"] - table["paper_angle_deg"]
    for name, value in zip(table["parameter"], difference, strict=True):
        if abs(value) > EDEM_TOLERANCE_DEG:
            remarks.append(f"{name}: our heap is {value:+.1f}° from EDEM's, more than {EDEM_TOLERANCE_DEG}°.")
    radius, base = table.loc[table["parameter"] == "radius_m", "changed_value"], config["material"]["radius_m"]
    if len(radius) and config["design"]["geometry"] == "scaled":
        speed, gravity = config["fidelity"]["campaign"]["lift_speed_m_s"], config["engine"]["gravity_m_s2"]
        lift = [speed / np.sqrt(gravity * r) for r in (base, radius.iloc[0])]
        remarks.append(
            f"A change of radius changes the lift speed relative to √(g r) from {lift[0]:.3f} to {lift[1]:.3f}. Stiff grains "
            "without cohesion have no other scale when the test grows too; docs/decisions/02 shows that nothing else acts."
        )
    beyond = table.loc[table["exceeds_noise"], "parameter"].tolist()
    remarks.append(f"Changes beyond the noise between seeds: {', '.join(beyond) or 'none'}.")
    return remarks


def monomial(names, powers) -> str:
    """A monomial for a table."""
    symbols = {"static_friction": "µs", "rolling_friction": "µr"}
    parts = [symbols.get(n, n) + ("²" if p == 2 else "") for n, p in zip(names, powers, strict=True) if p]
    return "·".join(parts) or "1"


def equation_table(surrogates) -> pd.DataFrame:
    """Coefficients of f and g, ours beside the printed ones, in Pa and degrees."""
    rows, printed = [], published()
    for response, surrogate in surrogates.items():
        theirs = dict(zip(printed[response].powers, printed[response].coefficients, strict=True))
        comparable = surrogate.grid_variables == printed[response].grid_variables
        for powers, value in zip(surrogate.powers, surrogate.coefficients, strict=True):
            other = theirs.get(tuple(powers)) if comparable else None
            rows.append(
                (response.replace("_", " "), f"f: {monomial(surrogate.grid_variables, powers)}", number(value, 2), number(other, 2))
            )
        for variable, factor in surrogate.g.items():
            published_g = printed[response].g.get(variable)
            names = ("1", "x", "x²") if factor.form == "quadratic" else ("−ln x",)
            for k, name in enumerate(names):
                reference = f"x = {variable.removesuffix('_m')}/{factor.reference:g}"
                rows.append(
                    (
                        response.replace("_", " "),
                        f"g: {name}, {reference}",
                        number(factor.coefficients[k], 3),
                        number(published_g.coefficients[k], 3) if published_g and published_g.form == factor.form else "–",
                    )
                )
    return pd.DataFrame(rows, columns=["response", "term", "ours", "paper's"])


def optimisation_table(calibration: pd.DataFrame) -> pd.DataFrame:
    """All optima, and the printed ones."""
    rows = []
    for _, row in calibration.iterrows():
        rows.append(
            (
                row["case"],
                SOURCES[row["surrogate"]],
                *optimum_cells(row),
                number(row["cost"], 5),
                row["iterations"],
                row["status"].replace("_", " "),
            )
        )
    for case, printed in paper.OPTIMA.items():
        status = {True: "converged", False: "not converged", None: "–"}[printed["converged"]]
        rows.append((case, "printed in the paper", *optimum_cells(printed), "–", printed["iterations"] or "–", status))
    columns = ["case", "source", "r (µm)", "µs", "µr", "c (Pa)", "φ (°)", "A (°)", "cost", "iterations", "Gauss–Newton"]
    return pd.DataFrame(
        sorted(rows, key=lambda row: list(calibration["case"]).index(row[0]) if row[0] in set(calibration["case"]) else 99),
        columns=columns,
    )


def optimum_cells(row) -> tuple[str, ...]:
    """Parameters and properties of one optimum."""
    return (
        number(row["radius_m"], 1, 1e6), number(row["static_friction"], 3), number(row["rolling_friction"], 4),
        number(row["cohesion_pa"], 0), number(row["friction_angle_deg"]), number(row["angle_of_repose_deg"]),
    )  # fmt: skip


def acceleration_table(table: pd.DataFrame) -> pd.DataFrame:
    """Bias of the acceleration."""
    digits = [1 if quantity.endswith("deg") else 3 for quantity in table["quantity"]]
    return pd.DataFrame(
        {
            "test": table["experiment"],
            "µs, µr": [f"{s:g}, {r:g}" for s, r in zip(table["static_friction"], table["rolling_friction"], strict=True)],
            "quantity": table["quantity"],
            "accelerated": [number(v, d) for v, d in zip(table["campaign_mean"], digits, strict=True)],
            "reference": [number(v, d) for v, d in zip(table["reference_mean"], digits, strict=True)],
            "runs": [f"{a} / {b}" for a, b in zip(table["campaign_n"], table["reference_n"], strict=True)],
            "bias": [with_error(v, e, d) for v, e, d in zip(table["bias"], table["bias_se"], digits, strict=True)],
            "beyond noise": np.where(table["exceeds_noise"], "yes", "no"),
            "time of a run (s)": [
                f"{number(a)} / {number(b)}"
                for a, b in zip(table["campaign_wall_time_s"], table["reference_wall_time_s"], strict=True)
            ],
        }
    )


def acceleration_remarks(table: pd.DataFrame) -> list[str]:
    """Whether the acceleration can be seen."""
    if table.empty:
        return ["This study has no check points."]
    beyond = table[table["exceeds_noise"]]
    if beyond.empty:
        return ["No bias exceeds two standard errors of the scatter between seeds."]
    return [
        f"{row['experiment']} at ({row['static_friction']:g}, {row['rolling_friction']:g}): the bias exceeds the noise."
        for _, row in beyond.iterrows()
    ]


def failed_table(tables) -> pd.DataFrame | None:
    """Failed simulations with their reasons; None if there are none."""
    columns = [
        "simulation_id",
        "experiment",
        "radius_m",
        "static_friction",
        "rolling_friction",
        "normal_stress_pa",
        "seed",
        "reason",
    ]
    runs = pd.concat([tables["repose"], tables["shear"]])
    failed = runs.loc[runs["status"] == "failed", columns]
    return None if failed.empty else failed
