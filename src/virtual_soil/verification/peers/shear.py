"""The direct shear test in LIGGGHTS, on a specimen consolidated by our engine.

`direct_shear` provides the grains before shearing. LIGGGHTS builds its own contact history while the lid loads the specimen for
SETTLE_TIMES inertial times, then shears the same frames at the same speed. The plateau is independent of the initial contact
history. The plates with their glued grains consist of standard fixes:

- lower: meshes that move along x, and the grains glued to the floor, moved by `nve/noforce`;
- lid: a mesh and its glued grains that share one vertical speed, m dv/dt = F_soil - load - c v, with our lid's mass and damping:
  `aveforce` applies the mean force to all glued grains, `move/mesh` moves the mesh with them. `setforce` fixes them horizontally.
"""

import math
from pathlib import Path
from typing import cast

import numpy as np

from dem import Drive
from dem.experiments import direct_shear
from dem.experiments.soil import Engine, Soil
from dem.experiments.specimen import GLUE_REACH_RATIO, inertial_time, lid
from virtual_soil.verification.peers.liggghts import MODEL, Liggghts, data_text, header_lines, material_lines, mesh_text, rectangle

SKIN_RATIO = 0.2
SETTLE_TIMES = 40.0
#: Mass of grains glued to the floor over that of a free grain; represents infinite mass.
HEAVY = 1e3
#: Quantities averaged over each sample: force on the glued grains before `aveforce` or `setforce`, force on the meshes, in N.
COLUMNS = {
    "floor_grains_x": "f_hold_floor[1]",
    "lid_grains_z": "f_press[3]",
    **{f"{mesh}_{axis}": f"f_{mesh}[{k}]" for mesh in ("floor", "lower", "upper", "lid") for k, axis in ((1, "x"), (3, "z"))},
}


class Specimen:
    """Consolidated specimen with its grains in the order floor, lid, free; `top_m` is the lid's height."""

    def __init__(self, shear: direct_shear.Shear, setup: direct_shear.Setup):
        z, radii = shear.before.positions_m[:, 2], shear.before.radii_m
        solid_m3 = 4.0 / 3.0 * math.pi * float((radii**3).sum())
        self.top_m = solid_m3 / (shear.solid_fraction * setup.area_m2)
        reach = (1.0 + GLUE_REACH_RATIO) * radii
        floor, lid = z < reach, z > self.top_m - reach
        order = np.argsort(np.where(floor, 0, np.where(lid, 1, 2)), kind="stable")
        self.n_floor, self.n_lid = int(floor.sum()), int(lid.sum())
        self.positions_m, self.radii_m = shear.before.positions_m[order], radii[order]
        self.positions_m[:, 1] %= setup.width_m


def meshes(specimen: Specimen, setup: direct_shear.Setup, ends_m: tuple[float, float]) -> dict[str, np.ndarray]:
    """Triangles of the four meshes; the flanges extend to ends_m along x, floor and lid over one box length."""
    length, mid = setup.length_m, 0.5 * specimen.top_m
    reach = specimen.top_m + 2.0 * setup.scale_radius_m
    across = (0.0, setup.width_m, 0.0)

    def wall(x0, z0, x1, z1):
        # NOTE: LIGGGHTS stops ("assertion failed") at some long triangles, so a wall is divided into near squares.
        along = np.array([x1 - x0, 0.0, z1 - z0])
        n = math.ceil(np.linalg.norm(along) / setup.width_m)
        return np.concatenate([rectangle((x0, 0.0, z0) + along * (k / n), along / n, across) for k in range(n)])

    return {
        "floor": wall(0.0, 0.0, length, 0.0),
        "lower": np.concatenate([wall(0.0, 0.0, 0.0, mid), wall(length, 0.0, length, mid), wall(ends_m[0], mid, 0.0, mid)]),
        "upper": np.concatenate([wall(0.0, mid, 0.0, reach), wall(length, mid, length, reach), wall(length, mid, ends_m[1], mid)]),
        "lid": wall(0.0, specimen.top_m, length, specimen.top_m),
    }


def input_lines(
    folder: Path, soil: Soil, setup: direct_shear.Setup, engine: Engine, specimen: Specimen, time_step_s: float
) -> list[str]:
    """Return the input up to the settled specimen under its lid; writes the files it refers to into the folder."""
    scale = setup.scale_radius_m
    room = (setup.displacement_ratio + 6.0) * scale
    ends = (-6.0 * scale, setup.length_m + room)
    box = [(ends[0] - room, ends[1] + room), (0.0, setup.width_m), (-4.0 * scale, specimen.top_m + 8.0 * scale)]
    n, n_floor, n_lid = len(specimen.radii_m), specimen.n_floor, specimen.n_lid
    drive = cast(Drive, lid(soil, setup, n, specimen.top_m).drive)
    density = np.full(n, soil.density_kg_m3)
    density[:n_floor] *= HEAVY
    grain_kg = soil.density_kg_m3 * 4.0 / 3.0 * math.pi * soil.radius_m**3
    density[n_floor : n_floor + n_lid] *= drive.mass_kg / (n_lid * grain_kg)
    (folder / "grains.data").write_text(data_text("shear", box, 2, specimen.positions_m, specimen.radii_m, density))
    triangles = meshes(specimen, setup, ends)
    for name, mesh in triangles.items():
        (folder / f"{name}.stl").write_text(mesh_text(mesh))
    mu, mu_frame, roll = soil.static_friction, setup.frame_static_friction, soil.rolling_friction
    kind = {"floor": 1, "lower": 2, "upper": 2, "lid": 1}
    return [
        *header_lines("f p f", folder / "grains.data", SKIN_RATIO * soil.radius_m),
        *material_lines(
            soil.shear_modulus_pa / engine.stiffness_reduction,
            soil.poisson_ratio,
            soil.restitution,
            [[mu, mu_frame], [mu_frame, mu_frame]],
            [[roll, 0.0], [0.0, 0.0]],
        ),
        f"timestep {time_step_s:.9g}",
        f"group glued_floor id <> 1 {n_floor}",
        f"group glued_lid id <> {n_floor + 1} {n_floor + n_lid}",
        "group free subtract all glued_floor glued_lid",
        f"fix gravity free gravity {engine.gravity_m_s2:.9g} vector 0.0 0.0 -1.0",
        *(f"fix {name} all mesh/surface/stress file {folder / name}.stl type {kind[name]}" for name in triangles),
        f"fix walls all wall/gran {MODEL} mesh n_meshes 4 meshes " + " ".join(triangles),
        "fix hold_floor glued_floor setforce 0.0 0.0 0.0",
        "fix hold_lid glued_lid setforce 0.0 0.0 NULL",
        "variable lid_speed equal vcm(glued_lid,z)",
        f"variable push equal (f_lid[3]{drive.applied_force_n:+.9g}-{drive.damping_kg_s:.9g}*v_lid_speed)/{n_lid}",
        "variable still equal 0.0",
        "fix press glued_lid aveforce NULL NULL v_push",
        "fix motion free nve/sphere",
        "fix lid_motion glued_lid nve",
        "fix floor_motion glued_floor nve/noforce",
        "fix lid_follows all move/mesh mesh lid linear/variable v_still v_still v_lid_speed",
        "thermo_style custom step atoms ke v_lid_speed",
        "thermo 1000000",
        "thermo_modify lost ignore norm no",
    ]


def shear_lines(speed_m_s: float, steps_per_sample: int) -> list[str]:
    """Return the commands that start the lower frame and record samples at a fixed interval of steps into samples.txt."""
    return [
        f"velocity glued_floor set {speed_m_s:.9g} 0.0 0.0 units box",
        f"fix floor_moves all move/mesh mesh floor linear {speed_m_s:.9g} 0.0 0.0",
        f"fix lower_moves all move/mesh mesh lower linear {speed_m_s:.9g} 0.0 0.0",
        f"fix samples all ave/time 1 {steps_per_sample} {steps_per_sample} {' '.join(COLUMNS.values())} file samples.txt",
    ]


def read_samples(text: str) -> dict[str, np.ndarray]:
    """Read step and every entry of COLUMNS, (n samples,) each, from the output of `ave/time`."""
    rows = np.array([line.split() for line in text.splitlines() if line and not line.startswith("#")], float)
    return dict(zip(["step", *COLUMNS], rows.T, strict=True))


def history(samples: dict[str, np.ndarray], setup: direct_shear.Setup, specimen: Specimen, soil: Soil, engine: Engine) -> dict:
    """Shear stress and normal stress on the shear plane as `direct_shear.record` defines them, (n samples,) each, in Pa."""
    upper = specimen.positions_m[:, 2] > 0.5 * specimen.top_m
    weight = 4.0 / 3.0 * math.pi * soil.density_kg_m3 * float((specimen.radii_m[upper] ** 3).sum()) * engine.gravity_m_s2
    shear = -(samples["floor_grains_x"] + samples["floor_x"] + samples["lower_x"])
    carried = samples["lid_grains_z"] + samples["lid_z"] + samples["upper_z"]
    return {"shear_stress_pa": shear / setup.area_m2, "plane_normal_stress_pa": (carried + weight) / setup.area_m2}


def run(folder: Path, soil: Soil, setup: direct_shear.Setup, engine: Engine, ours: direct_shear.Shear, time_step_s: float) -> dict:
    """Shear the initial specimen of `ours`; displacement and stresses, (n samples,) each, as in `Shear.history`.

    Raises
    ------
    PeerError : the program is missing or stopped. RuntimeError : grains leaked out of the box.
    """
    specimen = Specimen(ours, setup)
    speed = direct_shear.shear_speed(soil, setup)
    distance = setup.displacement_ratio * setup.scale_radius_m
    steps = max(1, math.ceil(distance / direct_shear.N_SAMPLES / speed / time_step_s))
    with Liggghts(folder, input_lines(folder, soil, setup, engine, specimen, time_step_s)) as peer:
        begin = peer.run(math.ceil(SETTLE_TIMES * inertial_time(soil, setup) / time_step_s))["Step"]
        # `ave/time` samples at multiples of its period, so the step counter is reset to 0.
        peer.send(["reset_timestep 0", *shear_lines(speed, steps)])
        now = peer.run(steps * direct_shear.N_SAMPLES)
        if now["Atoms"] < len(specimen.radii_m):
            raise RuntimeError(f"{len(specimen.radii_m) - now['Atoms']:.0f} grains leaked out of the shear box in LIGGGHTS")
        samples = read_samples((folder / "samples.txt").read_text())
    sheared = samples["step"] > 0
    samples = {name: column[sheared] for name, column in samples.items()}
    displacement = {"displacement_m": speed * samples["step"] * time_step_s}
    return displacement | history(samples, setup, specimen, soil, engine) | {"samples": samples, "settle_steps": begin}
