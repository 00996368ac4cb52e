"""Tables of a wheel's run beside its time series: stresses along the rim, the rut, and the flow in the wheel's middle plane."""

from dataclasses import asdict

import numpy as np

from dem.experiments.soil import Soil
from dem.experiments.soil_bed import SoilBed, surface
from dem.experiments.wheel import WheelRun
from dem.measure.flow import plane_flow
from dem.measure.rim import RimStress, rim_stress, steady_loads

#: Tables, each a file of a run, and their columns.
RIM = tuple(RimStress.__dataclass_fields__)
RUT = ("x_m", "y_m", "height_before_m", "height_after_m")
FIELD = ("x_m", "z_m", "radius_m", "displacement_x_m", "displacement_z_m", "velocity_x_m_s", "velocity_z_m_s")
#: Half thickness of the slice in the wheel's middle plane whose grains are the field, over the wheel's width.
SLICE_RATIO = 0.25


def tables_of(run: WheelRun | None, bed: SoilBed, soil: Soil) -> dict[str, dict]:
    """Name -> columns of the tables `rim`, `rut`, `field`; without rows where the run (None: it broke off) has none."""
    nothing: dict[str, dict] = {
        name: {column: [] for column in columns} for name, columns in {"rim": RIM, "rut": RUT, "field": FIELD}.items()
    }
    if run is None:
        return nothing
    found = {"rut": rut_table(bed, surface(run.moments["end"], soil, bed.setup))}
    if run.status == "done":
        loads = steady_loads(run.rim, run.history["time_s"])
        found["rim"] = asdict(rim_stress(loads, run.shape.radius_m, run.shape.width_m))
    if "flow_ends" in run.moments:
        found["field"] = field_table(run, bed, soil)
    return nothing | found


def rut_table(bed: SoilBed, after_m: np.ndarray) -> dict[str, np.ndarray]:
    """Columns RUT of every cell; after_m : map of the surface at the end, as `bed.heights_m`."""
    n, m = bed.heights_m.shape
    x = (np.arange(n) + 0.5) * bed.setup.length_m / n
    y = ((np.arange(m) + 0.5) / m - 0.5) * bed.setup.width_m  # the wheel is in the middle of the bed
    values = np.repeat(x, m), np.tile(y, n), (bed.heights_m - bed.level_m).ravel(), (after_m - bed.level_m).ravel()
    return dict(zip(RUT, values, strict=True))


def field_table(run: WheelRun, bed: SoilBed, soil: Soil) -> dict[str, np.ndarray]:
    """Columns FIELD of the grains near the middle plane."""
    rest, begin, end = (
        soil.wholes(grains) for grains in (bed.simulation.grains, run.moments["flow_begins"], run.moments["flow_ends"])
    )
    axle = 0.5 * (run.axles["flow_begins"] + run.axles["flow_ends"])
    duration = run.times_s["flow_ends"] - run.times_s["flow_begins"]
    period = np.array([bed.setup.length_m, bed.setup.width_m, 0.0])
    return plane_flow(rest, begin, end, duration, axle, SLICE_RATIO * run.shape.width_m, period)
