"""Read the files of a finished study."""

from pathlib import Path

import pandas as pd

from virtual_soil.campaign.inference import read_models
from virtual_soil.campaign.stored import stored
from virtual_soil.campaign.tables import read_provenance, read_table
from virtual_soil.report.laboratory import laboratory_of
from virtual_soil.report.study import Study


def read_study(files, config: dict) -> Study:
    """The study behind the input files of rule `report`."""
    tables = {Path(path).stem: read_table(path, Path(path).stem) for path in files.tables}
    before, after = stored(files.before, "grains"), stored(files.after, "grains")
    every: dict[str, list[pd.DataFrame]] = {name: [tables[name]] for name in dict.fromkeys(Path(path).stem for path in files.later)}
    for path in files.later:
        every[Path(path).stem].append(read_table(path, Path(path).stem))
    histories: dict[str, pd.DataFrame] = {}
    for path in files.histories:
        histories |= stored([path], f"{Path(path).parts[-3]}_history")
    return Study(
        config=config,
        tables=tables,
        every={name: pd.concat(parts) for name, parts in every.items()},
        models={kind: read_models(files.surrogates, kind) for kind in ("chosen", "quadratic", "gaussian_process")},
        rounds=[read_table(path, "verification") for path in files.rounds],
        residuals=read_table(files.residuals, "residuals"),
        twins=read_table(files.twins[0], "twins") if files.twins else None,
        states={name: (before[name], grains) for name, grains in after.items()},
        histories=histories,
        frames=read_table(files.lift[0], "lift") if files.lift else None,
        engine=read_provenance(files.after[0]).get("engine", "unknown"),
        laboratory=laboratory_of(files.soils),
    )
