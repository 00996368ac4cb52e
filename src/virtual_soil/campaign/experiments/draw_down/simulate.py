"""The draw-down test as a job: run from a design row, with stages for the progress line and rows for the tables."""

import math

from dem.experiments import draw_down
from dem.measure.draw_down import slopes
from dem.measure.packing import slice_solid_fraction
from virtual_soil.campaign.progress import Stage

MEASURED = ("simulated_time_s", "max_overlap_ratio", "energy_dissipated_j", "energy_residual_ratio")
#: Attribute of the slopes -> column.
SLOPES = {
    "left_deg": "draw_down_left_deg",
    "right_deg": "draw_down_right_deg",
    "scatter_deg": "draw_down_scatter_deg",
    "height_m": "left_behind_height_m",
    "bound_deg": "slope_least_deg",
}
#: Attributes of the result that hold the stored grains, before and after.
MOMENTS = ("before", "after")
#: Columns of the stored time series.
HISTORY = ("time_s", "mass_out_kg_m")
#: Stage of the test -> its end, for the progress line.
STAGES = {"fill": Stage(), "flow": Stage(then="until nothing flows, ")}


def run(soil, setup: dict, engine, seed: int, **callbacks):
    """Run or resume the test; arguments as in `dem.experiments.draw_down.run`."""
    return draw_down.run(soil, draw_down.Setup(**setup), engine, seed, **callbacks)


def row_of(flow, settings: dict) -> dict:
    """Return the row of the run table for a draw-down, or for a failed test (None)."""
    if flow is None:
        numbers = dict.fromkeys((*SLOPES.values(), "box_solid_fraction", *MEASURED), math.nan)
        return {"status": "failed", "n_particles": 0, "n_out": 0, "n_steps": 0, **numbers}
    found = {key: getattr(flow, key) for key in ("status", "n_particles", "n_out", "n_steps", *MEASURED)}
    box, before, after = flow.setup, flow.before, flow.after
    n = len(after) if flow.status == "done" else 0  # an arch or a wall is no slope
    left = slopes(after.positions_m[:n], after.radii_m[:n], box.length_m, box.slot_m, box.thickness_m, flow.left_radii_m)
    density = slice_solid_fraction(before.positions_m, before.radii_m, box.length_m, box.thickness_m, flow.filled_radii_m)
    return found | {column: getattr(left, name) for name, column in SLOPES.items()} | {"box_solid_fraction": density}
