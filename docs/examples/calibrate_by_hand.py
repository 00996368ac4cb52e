"""Calibrate one parameter by hand: the rolling friction whose heap is as steep as a measured one.

Lifts a tube off 500 grains for each of a few rolling frictions, measures every heap, and draws the one that fits best from the
side and from above. Run: .venv/bin/python docs/examples/calibrate_by_hand.py [picture.png] (seconds, after the first run).
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

from dem.experiments import angle_of_repose
from dem.experiments.soil import Engine, Soil
from dem.measure.heap import measure_heap

MEASURED_DEG = 30.0  # the angle that a photo of the real heap showed
ROLLING_FRICTIONS = (0.05, 0.1, 0.15, 0.2, 0.3)
RADIUS_M = 1e-3

setup = angle_of_repose.Setup(
    n_particles=500,
    tube_diameter_ratio=8.0,  # over the grain diameter
    plate_half_width_ratio=50.0,  # over the grain radius
    lift_speed_m_s=0.05,
    max_time_s=1.5,
    scale_radius_m=RADIUS_M,
)
# A hundredth of the stiffness makes steps ten times as long; the grains of a heap still overlap by only 0.2 % of a radius.
engine = Engine(stiffness_reduction=100.0, time_step_rayleigh_ratio=0.4)


def heap_with(rolling_friction: float) -> angle_of_repose.Heap:
    """A heap of sand-like grains that differ in nothing but their rolling friction."""
    soil = Soil(
        radius_m=RADIUS_M,
        density_kg_m3=2650.0,
        poisson_ratio=0.2,
        shear_modulus_pa=1e9,
        static_friction=0.5,
        rolling_friction=rolling_friction,
        restitution=0.5,
    )
    return angle_of_repose.run(soil, setup, engine, seed=1)


def draw(axes, grains, horizontal: int, vertical: int, depth: int) -> None:
    """Grains as circles at true scale (mm), the far ones first; indices are those of x, y, z."""
    near_last = np.argsort(grains.positions_m[:, depth] * (1 if depth == 2 else -1))
    places = 1e3 * grains.positions_m[near_last]
    diameters = 2e3 * grains.radii_m[near_last]
    axes.add_collection(
        EllipseCollection(
            diameters, diameters, 0.0, units="xy", offsets=places[:, [horizontal, vertical]], offset_transform=axes.transData,
            array=places[:, depth], edgecolors="black", linewidths=0.2,
        )
    )  # fmt: skip
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set(xlabel=f"{'xyz'[horizontal]} (mm)", ylabel=f"{'xyz'[vertical]} (mm)")


heaps, angles = {}, {}
for rolling_friction in ROLLING_FRICTIONS:
    heap = heaps[rolling_friction] = heap_with(rolling_friction)
    shape = measure_heap(heap.grains.positions_m, heap.grains.radii_m)
    angles[rolling_friction] = shape.angle_profile_deg
    print(f"rolling friction {rolling_friction:g}: angle of repose {shape.angle_profile_deg:.1f} deg ({heap.status})")

best = min(angles, key=lambda rolling_friction: abs(angles[rolling_friction] - MEASURED_DEG))
print(f"nearest to {MEASURED_DEG:g} deg: rolling friction {best:g}")

figure = Figure(figsize=(10, 4), layout="constrained")
side, above = figure.subplots(1, 2)
draw(side, heaps[best].grains, horizontal=0, vertical=2, depth=1)
draw(above, heaps[best].grains, horizontal=0, vertical=1, depth=2)
side.axhline(0.0, color="black")
side.set_title(f"from the side: {angles[best]:.1f}°")
above.set_title("from above")

picture = Path(sys.argv[1] if len(sys.argv) > 1 else "build/calibrate_by_hand.png")
picture.parent.mkdir(parents=True, exist_ok=True)
figure.savefig(picture, dpi=150)
print(f"picture: {picture}")
