"""The report: reads the tables of a finished study and fills the page's template."""

import base64
import io
from pathlib import Path

import jinja2
import numpy as np
import pandas as pd
import yaml

import _figures
from _tables import read_provenance, read_table
from calibration import from_json, paper, published
from calibration.mohr_coulomb import COLUMNS
from calibration.surrogate import RESPONSES

TEMPLATES = Path(__file__).resolve().parents[1] / "report"
TABLES = (
    "soil",
    "design",
    "repose",
    "shear",
    "strength",
    "screening",
    "residuals",
    "calibration",
    "iterations",
    "acceleration",
    "reachability",
)
#: Heaps at Table 2's points should come this near to EDEM's.
EDEM_TOLERANCE_DEG = 2.5

ASSUMPTIONS = (
    "Equal spheres unless a spread of radii is configured; the paper does not say.",
    "Tube, plate and the shear box's plates have the friction and stiffness of the grains; the box's side walls are smooth.",
    "Grains that touch floor and lid of the shear box are glued to them, like toothed plates.",
    "Shear specimens are prepared with reduced friction (tamped), heaps are poured with full friction.",
    "In the radius sweep the geometry grows with the grains unless configured otherwise; the lift speed stays.",
    "Strength is the plateau, and normal stress that on the shear plane, unless configured otherwise.",
    "The paper's Equation 3 is read with c in kPa and r0 = 200 µm for the shear test: only then does it give the printed values.",
)


def number(value, digits: int = 1, scale: float = 1.0) -> str:
    """A number for a table; a dash where there is none."""
    return "–" if value is None or pd.isna(value) else f"{scale * value:.{digits}f}"


def with_error(value, error, digits: int = 1) -> str:
    """Value ± error; the value alone where the error is unknown."""
    return number(value, digits) if pd.isna(error) else f"{number(value, digits)} ± {number(error, digits)}"


def embedded(figure, alt: str, caption: str) -> dict:
    """A figure as base64 PNG with its texts."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=130)
    return {"data": base64.b64encode(buffer.getvalue()).decode(), "alt": alt, "caption": caption}


def build(results: Path, config: dict, versions: dict) -> str:
    """HTML of the report on the study in folder `results`."""
    tables = {name: read_table(str(results / f"{name}.parquet"), name) for name in TABLES}
    surrogates = from_json((results / "surrogates.json").read_text(encoding="utf-8"))
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(TEMPLATES), autoescape=True, trim_blocks=True)
    return environment.get_template("template.html.j2").render(
        study=config["study"],
        cost=cost_sentence(tables),
        answer=answer_table(tables["calibration"]),
        answer_remarks=answer_remarks(tables),
        soils=soil_table(tables["soil"]),
        reachability=reachability_table(tables["reachability"]),
        reach_remarks=reach_remarks(tables["reachability"]),
        screening=screening_table(tables["screening"]),
        screening_remarks=screening_remarks(tables["screening"], config),
        equation=equation_table(surrogates),
        quality=quality_table(surrogates),
        fit_remarks=fit_remarks(tables, surrogates),
        optimisation=optimisation_table(tables["calibration"]),
        acceleration=acceleration_table(tables["acceleration"]),
        acceleration_remarks=acceleration_remarks(tables["acceleration"]),
        failed=failed_table(tables),
        figures=all_figures(results, config, tables, surrogates),
        assumptions=ASSUMPTIONS,
        versions=versions,
        engine=engine_of(results, tables),
        configuration=yaml.safe_dump(config, sort_keys=False),
    )


def engine_of(results: Path, tables) -> str:
    """Fingerprint of the engine that made the first heap."""
    first = tables["repose"]["simulation_id"].iloc[0]
    return read_provenance(str(results / "sims" / "repose" / first / "run.parquet")).get("engine", "unknown")


def cost_sentence(tables) -> str:
    """How much was simulated."""
    runs = pd.concat([tables["repose"], tables["shear"]])
    steps = float((runs["n_steps"] * runs["n_particles"]).sum())
    minutes = runs["wall_time_s"].sum() / 60.0
    counts = f"{len(tables['repose'])} heaps and {len(tables['shear'])} shear tests"
    return f"{counts}: {steps:.2g} grain-steps in {minutes:.1f} core-minutes."


def answer_table(calibration: pd.DataFrame) -> pd.DataFrame:
    """Our optima with predicted properties beside the targets."""
    ours = calibration[calibration["surrogate"] == "ours"]
    return pd.DataFrame(
        {
            "case": ours["case"],
            "r (µm)": [number(v, 1, 1e6) for v in ours["radius_m"]],
            "µs": [number(v, 3) for v in ours["static_friction"]],
            "µr": [number(v, 4) for v in ours["rolling_friction"]],
            "c (Pa), target": [
                f"{number(a, 0)} / {number(b, 0)}" for a, b in zip(ours["cohesion_pa"], ours["target_cohesion_pa"], strict=True)
            ],
            "φ (°), target": [
                f"{number(a)} / {number(b)}"
                for a, b in zip(ours["friction_angle_deg"], ours["target_friction_angle_deg"], strict=True)
            ],
            "A (°), target": [
                f"{number(a)} / {number(b)}"
                for a, b in zip(ours["angle_of_repose_deg"], ours["target_angle_of_repose_deg"], strict=True)
            ],
            "status": ours["status"].str.replace("_", " "),
        }
    )


def answer_remarks(tables) -> list[str]:
    """What a reader must know before using the parameters."""
    remarks = ["These are predictions of the surrogates; they are not yet confirmed by simulating the optimum."]
    for _, row in tables["calibration"].query("surrogate == 'ours'").iterrows():
        if row["at_bound"]:
            remarks.append(
                f"{row['case']}: the optimum lies at the edge of the simulated design ({row['at_bound'].replace(',', ', ')})."
            )
        if row["status"] != "converged":
            remarks.append(f"{row['case']}: {row['reason']}.")
        for name, (column, unit) in RESPONSES.items():
            simulated = tables["reachability"].query("response == @name").iloc[0]
            low, high = simulated["lowest_simulated"], simulated["highest_simulated"]
            if not low <= row[column] <= high:
                response = name.replace("_", " ")
                remarks.append(
                    f"{row['case']}: the predicted {response}, {row[column]:.1f} {unit}, lies beyond all that was simulated "
                    f"({low:.1f} to {high:.1f}): the surrogate extrapolates, and no such soil is known to exist."
                )
        if row["n_distinct"] > 1:
            remarks.append(f"{row['case']}: {row['n_distinct']} distinct minima were found; the cheapest is shown.")
    return remarks


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


def reachability_table(table: pd.DataFrame) -> pd.DataFrame:
    """Targets and simulated ranges."""
    return pd.DataFrame(
        {
            "soil": table["soil"],
            "property": table["response"].str.replace("_", " "),
            "target": [number(v) for v in table["target"]],
            "simulated": [
                f"{number(a)} to {number(b)}" for a, b in zip(table["lowest_simulated"], table["highest_simulated"], strict=True)
            ],
            "reachable": np.where(table["reachable"], "yes", "no"),
        }
    )


def reach_remarks(table: pd.DataFrame) -> list[str]:
    """One sentence per target outside the simulated range."""
    return [
        f"The {row['response'].replace('_', ' ')} of {row['soil']}, {row['target']:g}, is out of reach: simulated points give "
        f"{row['lowest_simulated']:.1f} to {row['highest_simulated']:.1f}; "
        f"the nearest reachable value is {row['nearest_reachable']:.1f}."
        for _, row in table[~table["reachable"]].iterrows()
    ]


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
            other = printed[response].g.get(variable)
            names = ("1", "x", "x²") if factor.form == "quadratic" else ("−ln x",)
            same = other is not None and other.form == factor.form
            for k, name in enumerate(names):
                reference = f"x = {variable.removesuffix('_m')}/{factor.reference:g}"
                rows.append(
                    (
                        response.replace("_", " "),
                        f"g: {name}, {reference}",
                        number(factor.coefficients[k], 3),
                        number(other.coefficients[k], 3) if same else "–",
                    )
                )
    return pd.DataFrame(rows, columns=["response", "term", "ours", "paper's"])


def quality_table(surrogates) -> pd.DataFrame:
    """Errors of fit."""
    rows = [
        (s.response.replace("_", " "), s.unit, s.n_points, number(s.r_squared, 3), number(s.rmse, 2), number(s.cv_rmse, 2))
        for s in surrogates.values()
    ]
    return pd.DataFrame(rows, columns=["response", "unit", "points", "R²", "RMSE", "RMSE, left out"])


def fit_remarks(tables, surrogates) -> list[str]:
    """What limits the surrogates."""
    strength = tables["strength"].query("fidelity == 'campaign'")
    noise, spread = strength["cohesion_se_pa"].median(), strength["cohesion_pa"].std()
    remarks = [
        f"Cohesion of a point is known to ± {noise:.0f} Pa (median standard error), beside a spread of {spread:.0f} Pa "
        "over the design: grains without adhesion have almost none, and what the regression finds is mostly noise."
    ]
    for s in surrogates.values():
        if s.r_squared < 0.9:
            remarks.append(f"The quadratic describes {s.response.replace('_', ' ')} poorly (R² = {s.r_squared:.2f}).")
    return remarks


def optimisation_table(calibration: pd.DataFrame) -> pd.DataFrame:
    """All optima, and the printed ones."""
    rows = []
    for _, row in calibration.iterrows():
        source = "our surrogates" if row["surrogate"] == "ours" else "published surrogates"
        rows.append(
            (row["case"], source, *optimum_cells(row), number(row["cost"], 5), row["iterations"], row["status"].replace("_", " "))
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


def base_point(table: pd.DataFrame, config: dict) -> pd.DataFrame:
    """Rows of the grid point nearest to the base couple, at the base radius and campaign fidelity."""
    grid = table[table["purposes"].str.contains("grid") & (table["fidelity"] == "campaign")]
    distance = sum((grid[name] - config["material"][name]).abs() for name in config["design"]["grid"])
    return grid[grid["point_id"] == grid.loc[distance.idxmin(), "point_id"]]


def all_figures(results: Path, config: dict, tables, surrogates) -> dict:
    """Every figure, embedded."""
    two_dimensional = set(config["design"]["grid"]) == {"static_friction", "rolling_friction"}
    figures = {**experiment_figures(results, config, tables)}
    if two_dimensional:
        figures |= response_figures(config, tables, surrogates)
    figures["iterations"] = embedded(
        _figures.iterations(tables["iterations"]),
        "Cost over iterations",
        "Gauss–Newton run that led to each optimum, or that began nearest to it.",
    )
    return figures


def experiment_figures(results: Path, config: dict, tables) -> dict:
    """Pictures of one heap and one shear test, and the shear curves."""
    heap_row, shear_rows = base_point(tables["repose"], config).iloc[0], base_point(tables["shear"], config)
    first_seed = shear_rows[shear_rows["seed"] == shear_rows["seed"].iloc[0]]

    def state(experiment, simulation, name, schema="grains"):
        return read_table(str(results / "sims" / experiment / simulation / f"{name}.parquet"), schema)

    couple = f"µs = {heap_row['static_friction']:g}, µr = {heap_row['rolling_friction']:g}"
    heap_id, box = heap_row["simulation_id"], first_seed.iloc[-1]
    angle = heap_row["angle_of_repose_deg"]
    histories = {
        row["normal_stress_pa"]: state("shear", row["simulation_id"], "history", "shear_history")
        for _, row in first_seed.iterrows()
    }
    strength = tables["strength"].query("fidelity == 'campaign'").set_index("point_id")
    figures = {
        "heap": embedded(
            _figures.heap(state("repose", heap_id, "filled"), state("repose", heap_id, "grains"), angle),
            f"Grains in the tube and heap with an angle of {angle:.1f} degrees",
            f"Figure 2: the tube is lifted and the heap comes to rest; {couple}. Colour: distance from the axis.",
        ),
        "shear_box": embedded(
            _figures.shear_box(
                state("shear", box["simulation_id"], "grains_before"), state("shear", box["simulation_id"], "grains_after")
            ),
            "Shear box before and after",
            f"Figure 3: the slice before and after shearing under {box['normal_stress_pa']:g} Pa; {couple}. "
            "Stripes show the deformation.",
        ),
        "shear_curves": embedded(
            _figures.shear_curves(histories),
            "Shear stress against displacement",
            f"Figure 4: shear stress under several normal stresses; {couple}.",
        ),
    }
    if box["point_id"] in strength.index:
        columns = COLUMNS[config["shear"]["strength"], config["shear"]["normal_stress"]]
        figures["strength_line"] = embedded(
            _figures.strength_lines(shear_rows, strength.loc[box["point_id"]], columns),
            "Mohr-Coulomb line",
            f"Equation 1: strength against normal stress, and the fitted line; {couple}.",
        )
    return figures


def response_figures(config: dict, tables, surrogates) -> dict:
    """Responses over the friction grid and the radius sweep."""
    figures, sweeps = {}, {}
    for response, (column, _) in RESPONSES.items():
        source = tables["repose"] if response == "angle_of_repose" else tables["strength"]
        known = source[(source["fidelity"] == "campaign") & source[column].notna()]
        error = {"cohesion": "cohesion_se_pa", "friction_angle": "friction_angle_se_deg"}.get(response)
        grid = known[known["purposes"].str.contains("grid")]
        name = response.replace("_", " ")
        figures[response] = embedded(
            _figures.response_lines(grid, column, surrogates[response], config["material"]["radius_m"], error),
            f"{name} over static and rolling friction",
            f"{'Figure 5: ' if response == 'angle_of_repose' else ''}{name} at r0; points simulated, lines f(µs, µr).",
        )
        sweeps[response] = known[known["purposes"].str.contains("sweep")]
    figures["radius_sweep"] = embedded(
        _figures.radius_sweep(sweeps, surrogates),
        "Responses over the radius",
        "Radius sweep; lines are g(r) times the couple's value at r0.",
    )
    return figures
