"""Adapt rule `compile_kernels`: run both experiments for a moment, so that every kernel they need is in the cache."""

from _log import log_to
from dem import Simulation, jit
from dem.experiments import angle_of_repose, direct_shear
from dem.experiments.soil import Engine, Soil

SOIL = Soil(
    radius_m=1e-3, density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e6, static_friction=0.3, rolling_friction=0.1,
    restitution=0.5,
)  # fmt: skip


def first_steps(simulation: Simulation) -> None:
    """A few steps compile the loop."""
    simulation.advance(2)
    simulation.is_static()


def main(settings, marker):
    engine = Engine(**settings)
    heap = angle_of_repose.Setup(
        n_particles=20, tube_diameter_ratio=10, plate_half_width_ratio=40, lift_speed_m_s=0.1, max_time_s=0.1,
        scale_radius_m=SOIL.radius_m,
    )  # fmt: skip
    box = direct_shear.Setup(
        length_ratio=20, height_ratio=10, width_ratio=5, displacement_ratio=1, normal_stress_pa=100.0, inertial_number=1e-2,
        frame_static_friction=0.0, preparation_friction_ratio=1.0, scale_radius_m=SOIL.radius_m,
    )  # fmt: skip
    first_steps(angle_of_repose.build(SOIL, heap, engine, seed=1))
    first_steps(direct_shear.build(SOIL, box, engine, seed=1))
    with open(marker, "w", encoding="utf-8") as file:
        file.write(f"kernels of source {jit.source_hash()} are compiled\n")


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.params.settings, snakemake.output.marker)
