"""The trade-off of the responses: virtual soils that no other one beats in all targets at once (the Pareto front)."""

import numpy as np
import pandas as pd

from virtual_soil.calibration.space import Space

#: Low-discrepancy points over which the front is looked for.
CROWD = 2**11


def non_dominated(errors: np.ndarray) -> np.ndarray:
    """Mask (m,) of the points of which no other has errors (m, k) that are all as small and one that is smaller."""
    no_larger = (errors[:, None, :] <= errors[None, :, :]).all(axis=-1)
    smaller = (errors[:, None, :] < errors[None, :, :]).any(axis=-1)
    return np.logical_not((no_larger & smaller).any(axis=0))


def trade_off(surrogates: dict, space: Space, targets: dict[str, tuple[float, float]]) -> pd.DataFrame:
    """Predictions over the box of the variables, and which of them are on the front.

    targets : response -> target and its standard uncertainty, which errors are in units of. Returns one row per point: variables,
    a column for every response in targets by its name, and `on_front`.
    """
    values = space.values(space.crowd(CROWD))
    predicted = {name: surrogates[name].predict(values) for name in targets}
    errors = np.column_stack([np.abs(predicted[name] - target) / error for name, (target, error) in targets.items()])
    return pd.DataFrame({**values, **predicted, "on_front": non_dominated(errors)})
