"""A paddle wheel from an STL file stirs a tray of grains, as a film. Run: .venv/bin/python docs/examples/paddle.py [paddle.gif]."""

import sys
import tempfile
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.collections import EllipseCollection, PolyCollection

import dem
from dem import solids

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402
from matplotlib.animation import PillowWriter  # noqa: E402

RADIUS_M, RATE_RAD_S, N_FRAMES, FRAME_S = 1.5e-3, 6.0, 30, 0.02

sand = dem.Material(density_kg_m3=2650.0, poisson_ratio=0.2, shear_modulus_pa=2e6)
touch = dem.Interaction(restitution=0.5, static_friction=0.5, rolling_friction=0.1)

with tempfile.TemporaryDirectory() as folder:  # in place of a file from CAD
    file = Path(folder) / "paddle.stl"
    dem.write_mesh(solids.wheel(0.012, 0.02, grousers=6, grouser_height_m=0.008, grouser_thickness_m=0.003), file)
    paddle = dem.read_mesh(file, "m", position_m=(0.0, 0.0, 0.052))

tray = solids.box((0.08, 0.024, 0.1), position_m=(0.0, 0.0, 0.05), solid=False)
simulation = dem.Simulation(
    materials={"sand": sand}, interactions={("sand", "sand"): touch}, smallest_radius_m=RADIUS_M, time_step_rayleigh_ratio=0.4,
    walls=[dem.Body(name="tray", material="sand", shape=tray)],
)  # fmt: skip
places = np.stack(np.meshgrid(*[np.arange(n) for n in (24, 7, 9)], indexing="ij"), axis=-1).reshape(-1, 3)
places = (places - (11.5, 3.0, 0.0)) * 3.2e-3 + (0.0, 0.0, 2e-3)
simulation.add_grains(places, RADIUS_M, "sand", np.random.default_rng(1).normal(0.0, 0.05, places.shape))
simulation.run(1.0, until=dem.Simulation.is_static)
motion = dem.Motion(velocity_m_s=(0.0, 0.0, -0.06), angular_velocity_rad_s=(0.0, RATE_RAD_S, 0.0))
simulation.add_wall(dem.Body(name="paddle", material="sand", shape=paddle, motion=motion))

colours = pyplot.get_cmap("viridis")(np.digitize(simulation.grains.positions_m[:, 2], [0.006, 0.012, 0.018]) / 3)
figure, axes = pyplot.subplots(figsize=(5, 3.4), layout="constrained")
film = PillowWriter(fps=12)
torques = []
with film.saving(figure, sys.argv[1] if len(sys.argv) > 1 else "paddle.gif", dpi=90):
    for _ in range(N_FRAMES):
        simulation.run(FRAME_S)
        if simulation.wall("paddle").position_m[2] < 0.036:
            simulation.move_wall("paddle", (0.0, 0.0, 0.0))
        torques.append(simulation.mean_wall_torques_n_m["paddle"][1])
        grains, turned = simulation.grains, simulation.wall("paddle")
        order = np.argsort(-grains.positions_m[:, 1])
        size = 2e3 * grains.radii_m[order]
        axes.clear()
        axes.add_collection(
            EllipseCollection(
                size, size, 0.0 * size, units="x", offsets=1e3 * grains.positions_m[order][:, [0, 2]], facecolors=colours[order],
                offset_transform=axes.transData,
            )
        )  # fmt: skip
        axes.add_collection(PolyCollection(1e3 * turned.corners_m[:, :, [0, 2]], facecolors="#888888", edgecolors="none"))
        axes.set(xlim=(-42, 42), ylim=(-2, 60), aspect="equal", xlabel="x (mm)", ylabel="z (mm)")
        film.grab_frame()
print(f"mean torque of the grains on the paddle: {1e6 * np.mean(torques[N_FRAMES // 2 :]):.1f} uN m")
