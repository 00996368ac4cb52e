"""The report's figures from the tables of a study, each with the table that it shows and a text for those who do not see it."""

from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure

from virtual_soil.calibration import published
from virtual_soil.calibration.mohr_coulomb import COLUMNS
from virtual_soil.calibration.surrogate import RESPONSES
from virtual_soil.report import plots

#: Standard errors of responses, where they are known.
ERRORS = {"cohesion": "cohesion_se_pa", "friction_angle": "friction_angle_se_deg"}
GRAIN_COLUMNS = ["x_m", "y_m", "z_m", "radius_m", "speed_m_s"]


@dataclass(frozen=True)
class Item:
    """A figure, what it shows as a table, and a text in its place."""

    figure: Figure
    data: pd.DataFrame
    alt: str


def base_point(table: pd.DataFrame, config: dict) -> pd.DataFrame:
    """Rows of the grid point nearest to the base couple, at the base radius and campaign fidelity."""
    grid = table[table["purposes"].str.contains("grid") & (table["fidelity"] == "campaign")]
    distance = sum((grid[name] - config["material"][name]).abs() for name in config["design"]["grid"])
    return grid[grid["point_id"] == grid.loc[distance.idxmin(), "point_id"]]


def experiment_figures(config: dict, tables, states: dict, histories: dict, frames: pd.DataFrame) -> dict[str, Item]:
    """Pictures of the base set's heap and shear test; states: simulation -> grains before and after, histories: its curve."""
    heap_row, shear_rows = base_point(tables["repose"], config).iloc[0], base_point(tables["shear"], config)
    first_seed = shear_rows[shear_rows["seed"] == shear_rows["seed"].iloc[0]]
    box = first_seed.iloc[-1]
    angle, couple = heap_row["angle_of_repose_deg"], f"µs {heap_row['static_friction']:g}, µr {heap_row['rolling_friction']:g}"
    curves = {row["normal_stress_pa"]: histories[row["simulation_id"]] for _, row in first_seed.iterrows()}
    heap, slice_ = states[heap_row["simulation_id"]], states[box["simulation_id"]]
    strength = tables["strength"].query("fidelity == 'campaign'").set_index("point_id")
    line = strength.loc[box["point_id"]] if box["point_id"] in strength.index else None
    columns = COLUMNS[config["shear"]["strength"], config["shear"]["normal_stress"]]
    return {
        "lift": Item(
            plots.lift(frames),
            frames.groupby("frame", as_index=False)[["time_s", "tube_bottom_m"]].first(),
            f"Four moments of the lift at {couple}: grains in the tube, flowing out under its rim, and at rest as a heap",
        ),
        "heap": Item(
            plots.heap(heap[0], heap[1], angle),
            moments(*heap),
            f"Grains in the tube and heap of {angle:.1f} degrees at {couple}",
        ),
        "shear_box": Item(
            plots.shear_box(*slice_),
            moments(*slice_),
            f"Shear box before and after under {box['normal_stress_pa']:g} Pa at {couple}",
        ),
        "shear_curves": Item(
            plots.shear_curves(curves),
            pd.concat([table.assign(normal_stress_pa=stress) for stress, table in curves.items()]),
            f"Shear stress against displacement under {len(curves)} normal stresses at {couple}",
        ),
        "strength_line": Item(
            plots.strength_lines(shear_rows, line, columns),
            shear_rows[["simulation_id", "seed", *dict.fromkeys(reversed(columns))]],
            f"Shear strength against normal stress with the Mohr-Coulomb line at {couple}",
        ),
    }


def moments(before: pd.DataFrame, after: pd.DataFrame) -> pd.DataFrame:
    """Grains before and after in one table."""
    return pd.concat([state[GRAIN_COLUMNS].assign(moment=name) for name, state in (("before", before), ("after", after))])


def known_points(tables, response: str) -> pd.DataFrame:
    """What the campaign says of a response, where it was measured."""
    source = tables["repose"] if response == "angle_of_repose" else tables["strength"]
    return source[(source["fidelity"] == "campaign") & source[RESPONSES[response][0]].notna()]


def response_figures(config: dict, tables, chosen, polynomials) -> dict[str, Item]:
    """Responses over the friction grid and the radius sweep."""
    figures, grids, sweeps, radius = {}, {}, {}, config["material"]["radius_m"]
    for response, (column, _) in RESPONSES.items():
        known = known_points(tables, response)
        grids[response] = grid = known[known["purposes"].str.contains("grid")]
        sweeps[response] = known[known["purposes"].str.contains("sweep")]
        printed = published()[response] if response == "angle_of_repose" else None
        figures[response] = Item(
            plots.response_lines(grid, column, chosen[response], polynomials[response], radius, ERRORS.get(response), printed),
            grid,
            f"{response.replace('_', ' ')} over static friction, a line for each rolling friction",
        )
    figures["surfaces"] = Item(
        plots.surfaces(grids, chosen, radius),
        pd.concat(list(grids.values())),
        "Cohesion, friction angle and angle of repose as surfaces over static and rolling friction",
    )
    figures["radius_sweep"] = Item(
        plots.radius_sweep(sweeps, polynomials), pd.concat(list(sweeps.values())), "The three responses over the radius"
    )
    return figures


def inference_figures(config: dict, tables, chosen, residuals: pd.DataFrame) -> dict[str, Item]:
    """Where the surrogates err and which parameters give the targets, over the friction grid."""
    sets = {"posterior": tables["posterior"], "equivalent": tables["equivalents"], "optimum": tables["calibration"]}
    return {
        "residuals": Item(
            plots.residual_map(residuals, config["material"]["radius_m"]),
            residuals,
            "Errors of both surrogates at left-out points of the friction grid",
        ),
        "iso": Item(
            plots.iso_responses(tables["calibration"], tables["posterior"], tables["equivalents"], chosen),
            pd.concat([table.assign(kind=kind) for kind, table in sets.items()]),
            "Curves of equal response through the targets, with the parameters that are consistent with them",
        ),
    }


def iteration_figure(tables) -> dict[str, Item]:
    """How the optimiser came to its answer."""
    return {"iterations": Item(plots.iterations(tables["iterations"]), tables["iterations"], "Cost over iterations")}
