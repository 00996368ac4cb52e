"""What the report's interactive views show, as plain values for `views.js`; each function takes tables."""

import math

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from virtual_soil.calibration.surrogate import RESPONSES
from virtual_soil.report import pack
from virtual_soil.report.calibrated import SYMBOLS
from virtual_soil.report.text import spoken

#: Grains in the 3D view of a study; about 7 bytes of the page each. Of larger studies a selection is shown.
MOST_GRAINS = 1_300_000
#: Points of a surface along static and rolling friction.
SURFACE_POINTS = (35, 25)
#: What may differ between points beside the design variables, and how a label names it.
FURTHER = {"density_kg_m3": "ρ", "poisson_ratio": "ν", "shear_modulus_pa": "G", "restitution": "e"}


def coordination(grains: pd.DataFrame, periodic_m: float = 0.0) -> np.ndarray:
    """Number of other grains that each grain touches; the space repeats after `periodic_m` along y, if that is not 0."""
    places, radii = grains[["x_m", "y_m", "z_m"]].to_numpy(copy=True), grains["radius_m"].to_numpy()
    if len(places) == 0:
        return np.zeros(0, int)
    if periodic_m:
        places[:, 1] %= periodic_m
        places[:, 1] %= periodic_m  # a rounding below zero ends at the period itself
    tree = cKDTree(places, boxsize=[0.0, periodic_m, 0.0] if periodic_m else None)
    first, second = tree.query_pairs(2.0 * radii.max(), output_type="ndarray").T
    apart = places[first] - places[second]
    if periodic_m:
        apart[:, 1] -= periodic_m * np.rint(apart[:, 1] / periodic_m)
    touch = np.linalg.norm(apart, axis=1) < radii[first] + radii[second]
    return np.bincount(np.concatenate([first[touch], second[touch]]), minlength=len(places))


def moved(before: pd.DataFrame, after: pd.DataFrame) -> np.ndarray | None:
    """How far each grain moved in mm; None where grains were lost, as it is not stored which."""
    if len(before) != len(after):
        return None
    columns = ["x_m", "y_m", "z_m"]
    return 1e3 * np.linalg.norm(after[columns].to_numpy() - before[columns].to_numpy(), axis=1)


def snapshot(before: pd.DataFrame, after: pd.DataFrame, periodic_m: float = 0.0) -> dict:
    """One simulation's grains at the end, packed, with all that colours them."""
    scalars = {"displacement": moved(before, after), "coordination": coordination(after, periodic_m)}
    scalars["speed"] = 1e3 * after["speed_m_s"].to_numpy()
    return pack.packed_grains(after, {name: values for name, values in scalars.items() if values is not None})


def labelled(rows: pd.DataFrame, material: dict, calibration: pd.DataFrame) -> pd.DataFrame:
    """Design rows with `label` and `rank` of their points: optima first, then the base set, then the others in order."""
    points = rows.drop_duplicates("point_id").copy()
    ours = calibration[calibration["surrogate"] == "ours"]
    labels, ranks = [], []
    for _, point in points.iterrows():
        label = f"µs {point['static_friction']:.3g}, µr {point['rolling_friction']:.3g}, r {1e6 * point['radius_m']:.3g} µm"
        label += "".join(f", {FURTHER[n]} {point[n]:g}" for n in FURTHER if not math.isclose(point[n], material[n]))
        cases = [row["case"] for _, row in ours.iterrows() if all(math.isclose(point[n], row[n], rel_tol=1e-3) for n in SYMBOLS)]
        base = all(math.isclose(point[n], material[n]) for n in (*SYMBOLS, *FURTHER))
        named = f"optimum of {', '.join(map(spoken, cases))}" if cases else "base set" if base else ""
        labels.append(f"{label} ({named})" if named else label)
        ranks.append(0 if cases else 1 if base else 2)
    points = points.assign(label=labels, rank=ranks)[["point_id", "label", "rank"]]
    variables = ["radius_m", "static_friction", "rolling_friction"]
    keys = ["rank", *variables, "point_id", "fidelity", "normal_stress_pa", "seed"]
    return rows.merge(points, on="point_id").sort_values(keys, kind="stable", ignore_index=True)


def run_label(row) -> str:
    """What tells the simulations of one point apart."""
    parts = [] if pd.isna(row["normal_stress_pa"]) else [f"p {row['normal_stress_pa']:g} Pa"]
    parts.append(f"seed {row['seed']}")
    return ", ".join(parts + ([] if row["fidelity"] == "campaign" else [row["fidelity"]]))


def selected(rows: pd.DataFrame, n_grains: dict[str, int], most: int = MOST_GRAINS) -> pd.DataFrame:
    """The rows to be shown: all, or those of the optima and the base set and as many others as fit, evenly chosen."""
    rows = rows[rows["simulation_id"].map(n_grains).fillna(0) > 0]
    counts = rows["simulation_id"].map(n_grains)
    if counts.sum() <= most:
        return rows
    kept = rows["rank"] < 2
    room, others = most - counts[kept].sum(), rows.index[~kept]
    n_more = max(int(room / max(counts[~kept].mean(), 1.0)), 0)
    chosen = others[np.unique(np.linspace(0, len(others) - 1, n_more).astype(int))] if n_more else []
    return rows[kept | rows.index.isin(chosen)]


def grain_view(rows: pd.DataFrame, states: dict[str, tuple], periods_m: dict[str, float]) -> tuple[dict, str]:
    """What the 3D view offers, and a sentence on what it leaves out; rows: `labelled`; states: id -> grains before and after."""
    some = selected(rows, {name: len(after) for name, (_, after) in states.items()})
    tests: dict[str, dict[str, list]] = {}
    for _, row in some.iterrows():
        name = row["simulation_id"]
        points = tests.setdefault(row["experiment"], {})
        before, after = states[name]
        grains = snapshot(before, after, periods_m.get(name, 0.0))
        points.setdefault(row["label"], []).append({"label": run_label(row), "id": name, "grains": grains})
    left_out = rows["simulation_id"].nunique() - some["simulation_id"].nunique()
    note = f"{some['simulation_id'].nunique()} simulations can be looked at."
    if left_out:
        note += f" {left_out} are left out: they failed, or lost all their grains, or the page would be too large."
    return tests, note


def lift_view(frames: pd.DataFrame) -> list[dict]:
    """The lift's frames: time, tube, packed grains coloured by the layer in which they began, speed and way."""
    first = frames[frames["frame"] == 0].set_index("grain")
    columns, top = ["x_m", "y_m", "z_m"], first["z_m"].max()
    view = []
    for _, frame in frames.groupby("frame"):
        start = first.loc[frame["grain"]]
        scalars = {
            "height at the start": 1e3 * start["z_m"].to_numpy(),
            "speed": 1e3 * frame["speed_m_s"].to_numpy(),
            "displacement": 1e3 * np.linalg.norm(frame[columns].to_numpy() - start[columns].to_numpy(), axis=1),
            "coordination": coordination(frame),
        }
        tube = {"radius_mm": 1e3 * frame["tube_radius_m"].iloc[0], "bottom_mm": 1e3 * frame["tube_bottom_m"].iloc[0]}
        grains = pack.packed_grains(frame, scalars)
        view.append({"time_s": frame["time_s"].iloc[0], "tube": {**tube, "top_mm": 1e3 * top}, "grains": grains})
    return view


def shear_view(rows: pd.DataFrame, histories: dict[str, pd.DataFrame]) -> dict:
    """Label of a point -> its shear curves; rows: `labelled`."""
    view: dict[str, list[dict]] = {}
    for _, row in rows[rows["experiment"] == "shear"].iterrows():
        history = histories.get(row["simulation_id"])  # a failed test has none
        if history is not None:
            curve = {
                "pressure": row["normal_stress_pa"],
                "label": run_label(row),
                "displacement": 1e3 * history["displacement_m"].to_numpy(),
                "time": history["time_s"].to_numpy(),
                "stress": history["shear_stress_pa"].to_numpy(),
            }
            view.setdefault(row["label"], []).append(curve)
    return view


def shown_radii(design: dict, calibration: pd.DataFrame) -> np.ndarray:
    """The sweep's radii and those of our optima, in m, ascending."""
    optima = calibration.loc[calibration["surrogate"] == "ours", "radius_m"]
    radii = np.sort(np.concatenate([np.asarray(design["sweep"].get("radius_m", []), float), optima]))
    return radii[np.diff(radii, prepend=0.0) > 1e-3 * radii]


def surface_view(kinds: dict[str, dict], radii_m: np.ndarray, points: dict[str, pd.DataFrame]) -> dict:
    """Every response over the friction grid at some radii; kinds: name -> {response: surrogate}; points: what was simulated."""
    ranges = next(iter(kinds["ours"].values())).ranges
    axes = ((*ranges[name], n) for name, n in zip(("static_friction", "rolling_friction"), SURFACE_POINTS, strict=True))
    s, r = (np.linspace(low, high, n) for low, high, n in axes)
    grid = dict(zip(("static_friction", "rolling_friction"), np.meshgrid(s, r), strict=True))
    fields = {
        kind: {
            response: [model.predict({**grid, "radius_m": np.full_like(grid["static_friction"], radius)}) for radius in radii_m]
            for response, model in models.items()
        }
        for kind, models in kinds.items()
    }
    simulated = {}
    for response, table in points.items():
        column, _ = RESPONSES[response]
        means = table.groupby(["radius_m", "static_friction", "rolling_friction"], as_index=False)[column].mean()
        columns = ("radius_m", "static_friction", "rolling_friction", column)
        simulated[response] = [1e6 * means["radius_m"], *(means[name] for name in columns[1:])]
    return {"static": s, "rolling": r, "radii_um": 1e6 * radii_m, "fields": fields, "simulated": simulated}


def iso_view(calibration: pd.DataFrame, posterior: pd.DataFrame, equivalents: pd.DataFrame, radii_m: np.ndarray) -> dict:
    """Case -> targets, optimum, posterior and equivalent sets; the curves themselves are drawn from `surface_view`."""
    view = {}
    for _, row in calibration[calibration["surrogate"] == "ours"].iterrows():
        sets = {}
        for name, table in (("posterior", posterior), ("equivalents", equivalents)):
            own = table[table["case"] == row["case"]]
            sets[name] = [own["static_friction"], own["rolling_friction"], 1e6 * own["radius_m"]]
        view[spoken(row["case"])] = {
            "targets": {response: row[f"target_{column}"] for response, (column, _) in RESPONSES.items()},
            "optimum": [row["static_friction"], row["rolling_friction"]],
            "radius": int(np.abs(radii_m - row["radius_m"]).argmin()),
            **sets,
        }
    return view
