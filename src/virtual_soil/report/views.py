"""Data of the interactive views in `views.js`, as plain values; each function takes tables."""

import math

import numpy as np
import pandas as pd
import scipy

from virtual_soil.campaign.experiments.registry import RESPONSES
from virtual_soil.campaign.grains import CLUMP
from virtual_soil.campaign.variables import PRINTED
from virtual_soil.report import pack
from virtual_soil.report.quantities import shown_in
from virtual_soil.report.text import spoken

#: Maximum number of grains in the 3D view, about 7 bytes of the page each; of larger studies a selection is shown.
MAX_GRAINS = 1_300_000
PLACES = ["x_m", "y_m", "z_m"]
FRICTIONS = ("static_friction", "rolling_friction")
#: Points of a surface along static and rolling friction.
SURFACE_POINTS = (35, 25)


def coordination(grains: pd.DataFrame, periodic_m: float = 0.0) -> np.ndarray:
    """Coordination number of each grain, of clumps for each of their spheres; `periodic_m` is the period along y, 0 if none."""
    places, radii = grains[PLACES].to_numpy(copy=True), grains["radius_m"].to_numpy()
    if len(places) == 0:
        return np.zeros(0, int)
    if periodic_m:
        places[:, 1] %= periodic_m
        places[:, 1] %= periodic_m  # a rounding below zero ends at the period itself
    tree = scipy.spatial.cKDTree(places, boxsize=[0.0, periodic_m, 0.0] if periodic_m else None)
    first, second = tree.query_pairs(2.0 * radii.max(), output_type="ndarray").T
    apart = places[first] - places[second]
    if periodic_m:
        apart[:, 1] -= periodic_m * np.rint(apart[:, 1] / periodic_m)
    touch = np.linalg.norm(apart, axis=1) < radii[first] + radii[second]
    owner = grains[CLUMP].to_numpy() if CLUMP in grains else np.arange(len(places))
    touch &= owner[first] != owner[second]
    return np.bincount(owner[np.concatenate([first[touch], second[touch]])], minlength=owner.max() + 1)[owner]


def moved(before: pd.DataFrame, after: pd.DataFrame) -> np.ndarray | None:
    """Displacement of each grain in mm; None if grains were lost, because the lost ones are not recorded."""
    return distance_mm(before, after) if len(before) == len(after) else None


def distance_mm(start: pd.DataFrame, end: pd.DataFrame) -> np.ndarray:
    """Distance between corresponding rows of two tables of grains in mm."""
    return 1e3 * np.linalg.norm(end[PLACES].to_numpy() - start[PLACES].to_numpy(), axis=1)


def snapshot(before: pd.DataFrame, after: pd.DataFrame, periodic_m: float = 0.0) -> dict:
    """One simulation's grains at the end, packed, with displacement, coordination number and speed."""
    scalars = {"displacement": moved(before, after), "coordination": coordination(after, periodic_m)}
    scalars["speed"] = 1e3 * after["speed_m_s"].to_numpy()
    return pack.packed_grains(after, {name: values for name, values in scalars.items() if values is not None})


def labelled(rows: pd.DataFrame, material: dict, calibration: pd.DataFrame) -> pd.DataFrame:
    """Design rows with `label` and `rank` of their points: optima first, then the base set, then the others in order."""
    points = rows.drop_duplicates("point_id").copy()
    optima = calibration[calibration["surrogate"] == "ours"]
    points[["label", "rank"]] = [point_label(point, material, optima) for _, point in points.iterrows()]
    merged = rows.merge(points[["point_id", "label", "rank"]], on="point_id")
    merged["lid_last"] = -merged["normal_stress_pa"]  # heaps first, then the largest stress
    keys = ["rank", *shown_in(merged), "point_id", "fidelity", "lid_last", "seed"]
    return merged.sort_values(keys, kind="stable", ignore_index=True, na_position="first").drop(columns="lid_last")


def point_label(point: pd.Series, material: dict, optima: pd.DataFrame) -> tuple[str, int]:
    """Label and rank of a point: below 1 for an optimum, in the order of the cases; 1 for the base set, 2 for any other point."""
    label = f"µs {point['static_friction']:.3g}, µr {point['rolling_friction']:.3g}, r {1e6 * point['radius_m']:.3g} µm"
    further = {n: v for n, v in shown_in(material).items() if n not in PRINTED and not math.isclose(point[n], material[n])}
    label += "".join(f", {v.symbol} {point[n] * v.scale:.4g} {v.unit}".rstrip() for n, v in further.items())
    cases = list(optima["case"])
    here = [
        row["case"] for _, row in optima.iterrows() if all(math.isclose(point[n], row[n], rel_tol=1e-3) for n in shown_in(optima))
    ]
    if here:
        return f"{label} (optimum of {', '.join(map(spoken, here))})", cases.index(here[0]) - len(cases)
    if all(math.isclose(point[n], material[n]) for n in shown_in(material)):
        return f"{label} (base set)", 1
    return label, 2


def run_label(row, fact: str = "") -> str:
    """Label of a simulation among those of its point, with what was measured in it."""
    parts = [] if pd.isna(row["normal_stress_pa"]) else [f"p {row['normal_stress_pa']:g} Pa"]
    parts.append(f"seed {row['seed']}")
    label = ", ".join(parts + ([] if row["fidelity"] == "campaign" else [row["fidelity"]]))
    return f"{label}: {fact}" if fact else label


def selected(rows: pd.DataFrame, n_grains: dict[str, int], most: int = MAX_GRAINS) -> pd.DataFrame:
    """Rows of at most so many grains: those of the optima and the base set, and an even selection of the others."""
    rows = rows[rows["simulation_id"].map(n_grains).fillna(0) > 0]
    counts = rows["simulation_id"].map(n_grains)
    if counts.sum() <= most:
        return rows
    kept = rows["rank"] < 2
    capacity, others = most - counts[kept].sum(), rows.index[~kept]
    n_more = max(int(capacity / max(counts[~kept].mean(), 1.0)), 0)
    chosen = others[np.unique(np.linspace(0, len(others) - 1, n_more).astype(int))] if n_more else []
    return rows[kept | rows.index.isin(chosen)]


def grain_view(
    rows: pd.DataFrame, states: dict[str, tuple], periods_m: dict[str, float], facts: dict[str, str]
) -> tuple[dict, str]:
    """Data of the 3D view, and a sentence on omitted simulations.

    rows : `labelled`. By simulation, states : grains before and after; facts : what was measured in it.
    """
    some = selected(rows, {name: len(after) for name, (_, after) in states.items()})
    tests: dict[str, dict[str, list]] = {}
    for _, row in some.iterrows():
        name = row["simulation_id"]
        points = tests.setdefault(row["experiment"], {})
        before, after = states[name]
        grains = snapshot(before, after, periods_m.get(name, 0.0))
        points.setdefault(row["label"], []).append({"label": run_label(row, facts.get(name, "")), "id": name, "grains": grains})
    left_out = rows["simulation_id"].nunique() - some["simulation_id"].nunique()
    note = f"{some['simulation_id'].nunique()} simulations can be looked at."
    if left_out:
        note += f" {left_out} are left out: they failed, or lost all their grains, or the page would be too large."
    return tests, note


def shown_radii(design: dict, calibration: pd.DataFrame) -> np.ndarray:
    """The sweep's radii and those of our optima, in m, ascending."""
    optima = calibration.loc[calibration["surrogate"] == "ours", "radius_m"]
    radii = np.sort(np.concatenate([np.asarray(design["sweep"].get("radius_m", []), float), optima]))
    return radii[np.diff(radii, prepend=0.0) > 1e-3 * radii]


def others(models: dict, chosen: dict) -> dict:
    """Those of some surrogates by response that are not the chosen ones, so that a view offers none twice."""
    return {response: model for response, model in models.items() if model.model != chosen[response].model}


def surface_view(kinds: dict[str, dict], radii_m: np.ndarray, points: dict[str, pd.DataFrame]) -> dict:
    """Every response over the friction grid at some radii; kinds: name -> {response: surrogate}; points: simulated ones."""
    ranges = next(iter(kinds["ours"].values())).ranges
    axes = [(*ranges[name], n) for name, n in zip(FRICTIONS, SURFACE_POINTS, strict=True)]
    s, r = (np.linspace(low, high, n) for low, high, n in axes)
    grid = dict(zip(FRICTIONS, np.meshgrid(s, r), strict=True))
    at_radii = [{**grid, "radius_m": np.full_like(grid["static_friction"], radius)} for radius in radii_m]
    fields = {
        kind: {response: [possible(response, model.predict(values)) for values in at_radii] for response, model in models.items()}
        for kind, models in kinds.items()
    }
    simulated = {response: mean_points(table, RESPONSES[response].column) for response, table in points.items()}
    return {"static": s, "rolling": r, "radii_um": 1e6 * radii_m, "fields": fields, "simulated": simulated}


def possible(response: str, values: np.ndarray) -> np.ndarray:
    """Predictions of a response, none below zero where no soil can be."""
    return values if RESPONSES[response].signed else np.maximum(values, 0.0)


def mean_points(table: pd.DataFrame, column: str) -> list[pd.Series]:
    """Radius in µm, static and rolling friction of every point, and the mean of a response over its rows."""
    variables = ["radius_m", *FRICTIONS]
    means = table.groupby(variables, as_index=False)[column].mean()
    return [1e6 * means["radius_m"], *(means[name] for name in (*FRICTIONS, column))]


def iso_view(calibration: pd.DataFrame, posterior: pd.DataFrame, equivalents: pd.DataFrame, radii_m: np.ndarray) -> dict:
    """Case -> targets, optimum, posterior and equivalent sets; the curves are drawn from the fields of `surface_view`."""
    view = {}
    for _, row in calibration[calibration["surrogate"] == "ours"].iterrows():
        sets = {}
        for name, table in (("posterior", posterior), ("equivalents", equivalents)):
            own = table[table["case"] == row["case"]]
            sets[name] = [own["static_friction"], own["rolling_friction"], 1e6 * own["radius_m"]]
        view[spoken(row["case"])] = {
            "targets": {
                name: row[f"target_{response.column}"] for name, response in RESPONSES.items() if f"target_{response.column}" in row
            },
            "optimum": [row["static_friction"], row["rolling_friction"]],
            "radius": int(np.abs(radii_m - row["radius_m"]).argmin()),
            **sets,
        }
    return view
