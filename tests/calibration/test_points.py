"""Points of the design: their seeds."""

from virtual_soil.calibration.points import own_seed, point_at, point_id

MATERIAL = {"radius_m": 5e-5, "static_friction": 0.3, "rolling_friction": 0.1}


def row(seed, **values):
    """A row of the design."""
    return {"seed": seed, "point_id": point_id(point_at(MATERIAL, values))}


def test_points_have_seeds_of_their_own():
    seeds = [own_seed(row(seed, static_friction=0.1 * k)) for k in range(1, 10) for seed in (1, 2, 3)]
    assert len(set(seeds)) == 27
    assert all(0 <= seed < 2**31 for seed in seeds)
    assert own_seed(row(1)) == own_seed({**row(1), "fidelity": "reference"})  # both fidelities test the same specimen
