"""Runs of wheel, plates and cone that nobody made, as tables of their schemas."""

import numpy as np
import pandas as pd

from virtual_soil.campaign.tables import check_table, load_schema

VALUES = {"case": "sand", "status": "done", "reason": "", "warnings": "", "held": "travel", "rim": "smooth"}


def rows(schema, **columns):
    """A table of a schema; a number that is not given is 0.5, a text that of VALUES."""
    n = len(next(iter(columns.values())))
    kinds = {"number": 0.5, "integer": 1, "string": "", "boolean": False}
    every = {name: VALUES.get(name, kinds.get(rule["type"])) for name, rule in load_schema(schema).items()}
    return check_table(pd.DataFrame({name: columns.get(name, [value] * n) for name, value in every.items()}), schema, "made up")


BEDS = rows("wheel_bed", seed=[1, 2], solid_fraction=[0.55, 0.60])


def travelled(pull, load=10.0):
    """History of a wheel of 0.1 m at slip 0.5: pull and torque are constant from half of the travel on, but for a swing."""
    time = np.linspace(-1.0, 2.0, 301)
    swing = np.where(np.arange(301) % 2, 0.1, -0.1)
    columns = {"time_s": time, "drawbar_pull_n": np.where(time > 1.0, pull, 99.0) + swing, "torque_n_m": np.full(301, 0.5)}
    columns |= {"sinkage_m": np.full(301, 0.02), "vertical_force_n": np.full(301, load), "speed_m_s": np.full(301, 0.1)}
    columns |= {"rim_rate_rad_s": np.where(time > 0.0, 2.0, 0.0), "load_n": np.full(301, load)}
    return pd.DataFrame({name: columns.get(name, np.zeros(301)) for name in load_schema("wheel_history")})


def pressed(k, n, depth_m=0.025):
    """History of a plate whose pressure is k z^n."""
    z = np.linspace(-0.002, depth_m, 300)
    columns = {"depth_m": z, "pressure_pa": k * np.maximum(z, 0.0) ** n}
    return pd.DataFrame({name: columns.get(name, np.zeros(300)) for name in load_schema("press_history")})
