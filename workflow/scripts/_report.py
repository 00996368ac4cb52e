"""The report: reads the tables of a finished study and fills the page's template."""

import base64
import io
from pathlib import Path

import jinja2
import numpy as np
import pandas as pd
import yaml

import _figures
import _report_calibration as calibrated
from _report_text import number, with_error
from _tables import read_provenance, read_table
from calibration import from_json, paper, published
from calibration.mohr_coulomb import COLUMNS
from calibration.surrogate import RESPONSES

TEMPLATES = Path(__file__).resolve().parents[1] / "report"
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


def embedded(figure, alt: str, caption: str) -> dict:
    """A figure as base64 PNG with its texts."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=130)
    return {"data": base64.b64encode(buffer.getvalue()).decode(), "alt": alt, "caption": caption}


def build(files, config: dict, versions: dict) -> str:
    """HTML of the report on a finished study; files: the rule's input (tables, residuals, surrogates, rounds, twins)."""
    tables = {Path(path).stem: read_table(path, Path(path).stem) for path in files.tables}
    results = Path(files.tables[0]).parent
    text = Path(files.surrogates).read_text(encoding="utf-8")
    models = {kind: from_json(text, kind) for kind in ("chosen", "quadratic", "gaussian_process")}
    chosen, polynomials = models.pop("chosen"), models["quadratic"]
    rounds = [read_table(path, "verification") for path in files.rounds]
    twins = read_table(files.twins[0], "twins") if files.twins else None
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(TEMPLATES), autoescape=True, trim_blocks=True)
    return environment.get_template("template.html.j2").render(
        study=config["study"],
        cost=cost_sentence(tables),
        answer=calibrated.answer_table(tables["calibration"]),
        properties=calibrated.properties_table(tables["verification"]),
        answer_remarks=calibrated.answer_remarks(tables),
        soils=soil_table(tables["soil"]),
        reachability=calibrated.reachability_table(tables["reachability"]),
        reach_remarks=calibrated.reach_remarks(tables["reachability"]),
        screening=screening_table(tables["screening"]),
        screening_remarks=screening_remarks(tables["screening"], config),
        equation=equation_table(polynomials),
        quality=calibrated.quality_table(models),
        fit_remarks=calibrated.fit_remarks(tables, chosen),
        sensitivity=calibrated.sensitivity_table(tables["sensitivity"]),
        optimisation=optimisation_table(tables["calibration"]),
        minima=calibrated.minima_table(tables["minima"]),
        identifiability=calibrated.identifiability_table(tables["identifiability"]),
        verification=calibrated.verification_table(tables["verification"]),
        gaps=calibrated.gap_table(rounds, tables["verification"]) if rounds else None,
        coverage=calibrated.coverage_sentence(tables["coverage"]),
        twins=calibrated.twin_table(twins),
        acceleration=acceleration_table(tables["acceleration"]),
        acceleration_remarks=acceleration_remarks(tables["acceleration"]),
        failed=failed_table(tables),
        figures=all_figures(results, config, tables, chosen, polynomials, read_table(files.residuals, "residuals")),
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


def base_point(table: pd.DataFrame, config: dict) -> pd.DataFrame:
    """Rows of the grid point nearest to the base couple, at the base radius and campaign fidelity."""
    grid = table[table["purposes"].str.contains("grid") & (table["fidelity"] == "campaign")]
    distance = sum((grid[name] - config["material"][name]).abs() for name in config["design"]["grid"])
    return grid[grid["point_id"] == grid.loc[distance.idxmin(), "point_id"]]


def all_figures(results: Path, config: dict, tables, chosen, polynomials, residuals) -> dict:
    """Every figure, embedded."""
    two_dimensional = set(config["design"]["grid"]) == {"static_friction", "rolling_friction"}
    figures = {**experiment_figures(results, config, tables)}
    if two_dimensional:
        figures |= response_figures(config, tables, chosen, polynomials)
        figures["residuals"] = embedded(
            _figures.residual_map(residuals, config["material"]["radius_m"]),
            "Errors of both surrogates at left-out points of the friction grid",
            "Residual maps: simulated minus predicted when the point is left out of the fit, over the friction grid at r0. "
            "Top: the paper's polynomial; bottom: the Gaussian process.",
        )
        figures["iso"] = embedded(
            _figures.iso_responses(tables["calibration"], tables["posterior"], tables["equivalents"], chosen),
            "Curves of equal response through the targets, with the parameters that are consistent with them",
            "Curves on which each property has its target value (bands: ± 5 %), at the optimum's radius. Dots: parameters "
            "consistent with the targets at any radius (posterior); circles: the equivalent sets; star: the optimum.",
        )
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


def response_figures(config: dict, tables, chosen, polynomials) -> dict:
    """Responses over the friction grid and the radius sweep."""
    figures, sweeps = {}, {}
    for response, (column, _) in RESPONSES.items():
        source = tables["repose"] if response == "angle_of_repose" else tables["strength"]
        known = source[(source["fidelity"] == "campaign") & source[column].notna()]
        error = {"cohesion": "cohesion_se_pa", "friction_angle": "friction_angle_se_deg"}.get(response)
        grid = known[known["purposes"].str.contains("grid")]
        name = response.replace("_", " ")
        figures[response] = embedded(
            _figures.response_lines(grid, column, chosen[response], polynomials[response], config["material"]["radius_m"], error),
            f"{name} over static and rolling friction",
            f"{'Figure 5: ' if response == 'angle_of_repose' else ''}{name} at r0; points simulated, lines the surrogate that the "
            "optimiser uses, dotted the paper's f(µs, µr).",
        )
        sweeps[response] = known[known["purposes"].str.contains("sweep")]
    figures["radius_sweep"] = embedded(
        _figures.radius_sweep(sweeps, polynomials),
        "Responses over the radius",
        "Radius sweep; lines are g(r) times the couple's value at r0.",
    )
    return figures
