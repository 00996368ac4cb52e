"""Read the files of a finished study."""

from pathlib import Path

import pandas as pd

from virtual_soil.campaign.inference import read_models
from virtual_soil.campaign.stored import stored
from virtual_soil.campaign.tables import read_provenance, read_table
from virtual_soil.report.experiments import EXPERIMENTS
from virtual_soil.report.study import Study


def read_study(files, config: dict) -> Study:
    """The study behind the input files of rule `report`."""
    tables = {Path(path).stem: read_table(path, Path(path).stem) for path in files.tables}
    before, after = stored([*files.filled, *files.before], "grains"), stored([*files.heaps, *files.after], "grains")
    later = {name: getattr(files, f"later_{name}") for experiment in EXPERIMENTS for name in experiment.TABLES}
    return Study(
        config=config,
        tables=tables,
        every={name: pd.concat([tables[name], *(read_table(path, name) for path in paths)]) for name, paths in later.items()},
        models={kind: read_models(files.surrogates, kind) for kind in ("chosen", "quadratic", "gaussian_process")},
        rounds=[read_table(path, "verification") for path in files.rounds],
        residuals=read_table(files.residuals, "residuals"),
        twins=read_table(files.twins[0], "twins") if files.twins else None,
        states={name: (before[name], grains) for name, grains in after.items()},
        histories=stored(files.histories, "shear_history"),
        frames=read_table(files.lift, "lift"),
        engine=read_provenance(files.heaps[0]).get("engine", "unknown"),
    )
