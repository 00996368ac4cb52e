"""Pour heaps of spheres and of dimers without rolling friction. Run: .venv/bin/python docs/examples/clumps.py (half a minute)."""

import dem
from dem.measure.heap import measure_heap
from dem.measure.orientation import measure_orientations

RADIUS_M, N_SPHERES = 1e-3, 1600
DIMER = dem.Clump.preset("dimer")  # or dem.Clump.read("shape.txt"), with a line x y z r per sphere

sand = dem.Material(density_kg_m3=2650.0, poisson_ratio=0.2, shear_modulus_pa=1e7)
rough = dem.Interaction(restitution=0.5, static_friction=0.5, rolling_friction=0.0)


def pour(shape: dem.Clump | None) -> dem.Simulation:
    """Fill a tube with grains of a shape (None: spheres), lift it, and wait for the heap to rest."""
    plate = dem.Box(name="plate", material="sand", low_m=(-0.1, -0.1, 0.0), high_m=(0.1, 0.1, 0.0))
    tube = dem.Tube(name="tube", material="sand", radius_m=12 * RADIUS_M, bottom_m=0.0, top_m=0.5)
    simulation = dem.Simulation(
        materials={"sand": sand}, interactions={("sand", "sand"): rough}, walls=[plate, tube], smallest_radius_m=RADIUS_M,
        time_step_rayleigh_ratio=0.4, floor_m=-0.01,
    )  # fmt: skip
    n, size_m = (N_SPHERES, RADIUS_M) if shape is None else (N_SPHERES // shape.n_spheres, RADIUS_M / shape.smallest_ratio)
    region, sizes = dem.TubeRegion(radius_m=12 * RADIUS_M, bottom_m=0.0), dem.Sizes(mean_m=size_m)
    simulation.add_factory(dem.Factory(n_grains=n, region=region, sizes=sizes, material="sand", seed=1, shape=shape))
    simulation.run(0.5, until=lambda s: s.is_static(1e-6))
    simulation.move_wall("tube", (0.0, 0.0, 0.03))
    simulation.run(2.0, until=lambda s: s.wall("tube").bottom_m > s.top_m and s.is_static(1e-6))
    return simulation


for name, shape in (("spheres", None), ("dimers", DIMER)):
    heap = pour(shape)
    form = measure_heap(heap.grains.positions_m, heap.grains.radii_m, None if shape is None else heap.clumps.radii_m)
    print(f"{name}: angle of repose {form.angle_profile_deg:.1f} deg, {1e3 * form.heap_height_m:.1f} mm high")
    if shape is not None:
        axes = measure_orientations(heap.clumps.orientations, heap.clumps.moments_kg_m2)
        print(f"long axes: {axes.mean_tilt_deg:.1f} deg from the vertical in the mean, order {axes.order:.2f}")
