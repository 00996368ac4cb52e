"""Shear curves of the laboratory beside those of the simulated optimum."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from virtual_soil.campaign.experiments.shear.laboratory import ShearTests
from virtual_soil.report.plots import COLOURS
from virtual_soil.report.study import Study, runs_at

#: Experiment -> column of its history along which its specimens are sheared, factor to the printed unit, and words.
SHEARED = {
    "shear": ("displacement_m", 1e3, "displacement of the lower frame (mm)"),
    "plane_shear": ("shear_strain", 1.0, "shear strain"),
}


def sheared_test(config: dict) -> str | None:
    """Name of the study's shear test; None if it has none. Of two, the one that measures the steady strength."""
    found = [name for name in reversed(SHEARED) if name in config["experiments"]]
    return found[0] if found else None


def curves_at(study: Study, optimum: pd.Series) -> pd.DataFrame:
    """Histories of all simulations of an optimum as one table, with their normal stress and seed."""
    name = sheared_test(study.config)
    assert name is not None
    parts = [
        study.histories[run["simulation_id"]].assign(normal_stress_pa=run["normal_stress_pa"], seed=run["seed"])
        for _, run in runs_at(study, name, optimum).iterrows()
        if run["simulation_id"] in study.histories
    ]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=["normal_stress_pa", "seed"])


def draw_beside(laboratory: ShearTests, simulated: pd.DataFrame, experiment: str) -> Figure:
    """Shear over normal stress: the laboratory's curves over displacement, and every simulated test of the optimum beside them."""
    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for colour, curve in zip(np.resize(COLOURS, len(laboratory.curves)), laboratory.curves, strict=True):
        stress = 1e-3 * float(np.median(curve.normal_stress_pa))
        left.plot(1e3 * curve.displacement_m, curve.shear / curve.normal_stress_pa, color=colour, label=f"{stress:.3g} kPa")
    column, scale, words = SHEARED[experiment]
    for k, (stress, tests) in enumerate(simulated.groupby("normal_stress_pa")):
        for number, (_, test) in enumerate(tests.groupby("seed")):
            label = None if number else f"{1e-3 * float(stress):.3g} kPa"
            ratio = test["shear_stress_pa"] / test["plane_normal_stress_pa"]
            right.plot(scale * test[column], ratio, color=COLOURS[k % len(COLOURS)], linewidth=0.7, label=label)
    left.set(title="laboratory", xlabel="displacement (mm)", ylabel="shear stress over normal stress")
    right.set(title="simulated at the optimum", xlabel=words)
    for axes in (left, right):
        axes.legend(fontsize="x-small")
    return figure
