"""Pour a small heap with the public API and print its angle of repose. Run: .venv/bin/python docs/examples/heap.py (seconds)."""

import dem
from dem.measure.heap import measure_heap

RADIUS_M = 1e-3

sand = dem.Material(density_kg_m3=2650.0, poisson_ratio=0.2, shear_modulus_pa=1e7)
rough = dem.Interaction(restitution=0.5, static_friction=0.5, rolling_friction=0.2)
plate = dem.Box(name="plate", material="sand", low_m=(-0.1, -0.1, 0.0), high_m=(0.1, 0.1, 0.0))
tube = dem.Tube(name="tube", material="sand", radius_m=10 * RADIUS_M, bottom_m=0.0, top_m=0.5)

simulation = dem.Simulation(
    materials={"sand": sand},
    interactions={("sand", "sand"): rough},
    walls=[plate, tube],
    smallest_radius_m=RADIUS_M,
    time_step_rayleigh_ratio=0.4,
)
region = dem.TubeRegion(radius_m=10 * RADIUS_M, bottom_m=0.0)
simulation.add_factory(dem.Factory(n_grains=1000, region=region, sizes=dem.Sizes(mean_m=RADIUS_M), material="sand", seed=1))

simulation.run(0.5, until=lambda s: s.is_static(1e-6))
print("filled:", simulation)
simulation.move_wall("tube", (0.0, 0.0, 0.03))
simulation.run(2.0, until=lambda s: s.wall("tube").bottom_m > 0.03 and s.is_static())
print("at rest:", simulation)

heap = measure_heap(simulation.grains.positions_m, simulation.grains.radii_m)
print(f"angle of repose {heap.angle_profile_deg:.1f} deg, heap height {1e3 * heap.heap_height_m:.1f} mm")
