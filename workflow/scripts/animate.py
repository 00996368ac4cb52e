"""Adapt rule `animate` to the experiments: simulate once more, keep what every look shows, draw it and write it for ParaView."""

from _log import log_to
from dem.experiments import angle_of_repose, direct_shear
from virtual_soil.campaign.simulate import engine_of, soil_of
from virtual_soil.report.film import Film, layers, stripes, write_gif
from virtual_soil.report.paraview import write_series


def film_lift(row, settings):
    """The angle-of-repose test's setup, and the film of its lift."""
    film = Film("lift")
    numerics = engine_of(settings, settings["softening"]["repose_stiffness_reduction"])
    setup = angle_of_repose.Setup(**settings["setup"])
    angle_of_repose.run(soil_of(row), setup, numerics, row["seed"], each=film)
    return setup, film


def animate_repose(row, settings, path):
    """The tube is lifted off the heap; a cut through the middle, grains coloured by the layer in which they began. The frames."""
    setup, film = film_lift(row, settings)

    def title(frame):
        lifted_m = frame.walls["tube"].bottom_m
        return f"tube lifted by {1e3 * lifted_m:.2f} mm, {lifted_m / setup.lift_speed_m_s:.3f} s"

    write_gif(path, film.shown(), layers(film.frames[0].grains), title, cut=True)
    return film.shown()


def animate_shear(row, settings, path):
    """The lower frame moves under the upper one; grains keep the colour of the stripe in which they began. The frames."""
    film = Film("shear")
    soil = soil_of(row)
    setup = direct_shear.Setup(normal_stress_pa=row["normal_stress_pa"], **settings["setup"])
    number, gravity = settings["softening"]["shear_stiffness_number"], settings["engine"]["gravity_m_s2"]
    numerics = engine_of(settings, direct_shear.stiffness_reduction(soil, setup, number, gravity))
    direct_shear.run(soil, setup, numerics, row["seed"], each=film)

    def title(frame):
        return f"sheared by {1e3 * frame.walls['lower_left'].low_m[0]:.2f} mm under {setup.normal_stress_pa:g} Pa"

    write_gif(path, film.shown(), stripes(film.frames[0].grains), title)
    return film.shown()


if __name__ == "__main__":
    log_to(snakemake.log[0])
    animate = {"repose": animate_repose, "shear": animate_shear}[snakemake.wildcards.experiment]
    frames = animate(snakemake.params.row, snakemake.params.settings, snakemake.output.film)
    moments = [(frame.time_s, frame.grains, frame.numbers) for frame in frames]
    write_series(snakemake.output.series, snakemake.output.moments, moments)
