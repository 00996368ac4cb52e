"""Tables and figures of what happens under the wheel: rim, rut, flow."""

import numpy as np
import pandas as pd
import pytest
from made_up_runs import BEDS, rows, travelled

from dem.experiments.soil_bed import Setup, SoilBed
from virtual_soil.campaign.tables import check_table
from virtual_soil.wheel import contact_figures
from virtual_soil.wheel.fields import rut_table
from virtual_soil.wheel.measured import wheel_table
from virtual_soil.wheel.page import Results, write_page

R, B = 0.1, 0.06
RUN = {"radius_m": R, "width_m": B}


def made_up_bed():
    """A bed without grains whose surface is rough: cells of 10 mm, 60 along and 20 across."""
    heights = 0.1 + 1e-3 * np.random.default_rng(1).uniform(-1.0, 1.0, (60, 20))
    return SoilBed(Setup(length_m=0.6, width_m=0.2, depth_m=0.1), None, "done", 0.1, heights, 0.5, 1250.0, np.zeros(0, int), 1, 0.0)


def history():
    """A travel from 0.19 to 0.41 m, after the wheel was lowered."""
    made_up = travelled(1.0)
    return made_up.assign(x_m=0.19 + 0.11 * made_up["time_s"].clip(lower=0.0))


def rut(change_m=0.0):
    """Rut of a wheel that pressed the cells under it by change_m, from 0.15 to 0.45 m."""
    bed = made_up_bed()
    after = bed.heights_m.copy()
    after[15:45, 7:13] += change_m
    return check_table(pd.DataFrame(rut_table(bed, after)), "wheel_rut", "rut")


def rim(normal_pa=2e3):
    theta = np.arange(-177.5, 180.0, 5.0)
    stress = np.where(np.abs(theta - 15.0) < 30.0, normal_pa, 0.0)
    columns = {"theta_deg": theta, "normal_stress_pa": stress, "normal_stress_error_pa": 0.1 * stress}
    columns |= {"shear_stress_pa": 0.3 * stress, "shear_stress_error_pa": 0.0 * stress}
    return check_table(pd.DataFrame(columns), "wheel_rim", "rim")


def field():
    x, z = (axis.ravel() for axis in np.meshgrid(np.linspace(-0.3, 0.3, 31), np.linspace(-0.2, -0.1, 6)))
    columns = {"x_m": x, "z_m": z, "radius_m": 0.005, "displacement_x_m": 1e-3, "displacement_z_m": 0.0}
    columns |= {"velocity_x_m_s": 0.02, "velocity_z_m_s": np.where(x == 0.0, -0.015, 0.0)}
    return check_table(pd.DataFrame(columns), "wheel_field", "field")


def test_without_a_wheel_the_rut_is_zero():
    across, along = contact_figures.profiles(RUN, history(), rut())
    assert not across["mean"].any()
    assert not along["mean"].any()


def test_the_rut_is_as_deep_and_wide_as_the_wheel_has_pressed_the_surface():
    across, along = contact_figures.profiles(RUN, history(), rut(-4e-3))
    under = np.abs(across.index) < 0.5 * B
    assert under.sum() == 6
    assert across["mean"][under].to_numpy() == pytest.approx(-4e-3)
    assert not across["mean"][~under].any()
    assert across["std"].to_numpy() == pytest.approx(0.0, abs=1e-12)
    pressed = (along.index > 0.15) & (along.index < 0.45)
    assert along["mean"][pressed].to_numpy() == pytest.approx(-4e-3)
    assert not along["mean"][~pressed].any()


def test_cells_in_front_of_the_wheel_are_no_part_of_the_profile_across():
    early = history().assign(x_m=lambda made_up: made_up["x_m"] - 0.1)  # begins 60 mm before the pressed cells
    across, _ = contact_figures.profiles(RUN, early, rut(-4e-3))
    assert across["mean"].min() == pytest.approx(-4e-3 * 11 / 17)  # of cells from 0.095 to 0.255 m, 11 from 0.155 on


def test_the_stresses_are_drawn_in_kpa_over_the_loaded_part_of_the_rim():
    runs = rows("wheel_run", seed=[1, 1, 2], asked_slip=[0.1, 0.5, 0.5])
    left, right = contact_figures.along_rim(runs, [rim(), rim(4e3), rim(9e3)]).axes
    drawn = [line.get_ydata() for line in left.lines if len(line.get_ydata()) > 2]
    assert [values.max() for values in drawn] == pytest.approx([2.0, 4.0])  # the first bed alone
    assert right.lines[0].get_ydata().max() == pytest.approx(0.6)
    assert left.get_xlim() == pytest.approx((-22.5, 52.5))


def test_the_flow_is_drawn_for_the_first_middle_and_last_run_with_its_fastest_grain():
    runs = rows("wheel_run", seed=[1] * 6, asked_slip=[0.0, 0.1, 0.2, 0.3, 0.4, 0.5], radius_m=[R] * 6)
    figure = contact_figures.field(runs, [field()] * 3 + [field()[:0]] + [field()] * 2)
    titles = [axes.get_title() for axes in figure.axes if axes.get_title()]
    assert titles == [f"sand, s = {slip}; longest arrow 25 mm/s" for slip in ("0", "0.2", "0.5")]


@pytest.mark.parametrize("empty", [False, True])
def test_the_page_shows_rim_rut_and_field_also_of_runs_that_broke_off(tmp_path, empty):
    runs = rows("wheel_run", seed=[1], radius_m=[R], width_m=[B], asked_slip=[0.5], status=["failed" if empty else "done"])
    made_up = {"rim": rim(), "rut": rut(-4e-3), "field": field()}
    fields = {name: [table[:0] if empty else table] for name, table in made_up.items()}
    histories = [history()[:0] if empty else history()]
    tables = {"wheel": wheel_table(runs, histories, BEDS)}
    results = Results({"sand": ["confirmed", "matches"]}, tables, {"wheel": runs}, {"wheel": histories}, fields=fields)
    write_page(results, tmp_path / "wheel.md", tmp_path / "figures")
    text = (tmp_path / "wheel.md").read_text(encoding="utf-8")
    for name in made_up:
        assert f"](figures/{name}.png)" in text
        assert (tmp_path / f"figures/{name}.png").stat().st_size > 3000
