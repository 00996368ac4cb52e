"""The modules of the cases by name, and tables of their runs."""

from importlib import import_module
from pathlib import Path
from types import ModuleType

import pandas as pd

from virtual_soil.bulk.packings import Packing
from virtual_soil.bulk.run import Run
from virtual_soil.bulk.variants import OURS


def module_of(case: str) -> ModuleType:
    """Module of a case: SETUPS by variant, `ours` and `of_liggghts`. Imported by name: a change in one case reruns no other."""
    return import_module(f"virtual_soil.bulk.{case}")


def run(case: str, code: str, packing: Packing, variant: str, folder: Path) -> Run:
    """Run a variant of a case in one of CODES; folder : for the peer's files."""
    module = module_of(case)
    setup = module.SETUPS[variant]
    return module.ours(packing, setup) if code == OURS else module.of_liggghts(packing, setup, folder)


def curve_table(done: Run) -> pd.DataFrame:
    """Curves in long form: t_s, quantity, value."""
    curves = [pd.DataFrame({"t_s": done.times_s, "quantity": name, "value": values}) for name, values in done.values.items()]
    return pd.concat(curves, ignore_index=True)


def cost_table(done: Run, case: str, code: str, variant: str, processor: str) -> pd.DataFrame:
    """One row: what the run was and cost."""
    return pd.DataFrame(
        [
            {
                "case": case,
                "code": code,
                "variant": variant,
                "n_grains": done.n_grains,
                "n_steps": done.n_steps,
                "time_step_s": done.time_step_s,
                "grain_steps": done.grain_steps,
                "wall_s": done.wall_s,
                "processor_s": done.processor_s,
                "processor": processor,
            }
        ]
    )


def curves_of(table: pd.DataFrame) -> pd.DataFrame:
    """Curves of a long table in wide form: index t_s, a column for every quantity."""
    return table.pivot(index="t_s", columns="quantity", values="value")
