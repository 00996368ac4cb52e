"""Adapt rule `wheel_report` to `virtual_soil.wheel.page.write_page`."""

from pathlib import Path

from _log import log_to
from virtual_soil.campaign.tables import read_table
from virtual_soil.report.html_page import write_html
from virtual_soil.wheel.measured import stacked
from virtual_soil.wheel.page import Results, write_page

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files, of_tool = dict(snakemake.input.items()), {"wheel": "wheel", "plate": "press", "cone": "press"}
    tools = [tool for tool in of_tool if files[f"{tool}_runs"]]
    results = Results(
        verdicts=snakemake.params.verdicts,
        tables={Path(path).stem: read_table(path, Path(path).stem) for path in files["tables"]},
        runs={tool: stacked(files[f"{tool}_runs"], f"{of_tool[tool]}_run") for tool in tools},
        measured=read_table(files["measured"], "wheel_measured") if files["measured"] else None,
        handbook=read_table(files["handbook"], "wheel_handbook") if files["handbook"] else None,
        sources=tuple(source for source in snakemake.params.sources if source),
        asked_density_kg_m3=snakemake.params.asked_density_kg_m3,
        soils=snakemake.params.soils,
        engine=snakemake.params.engine,
        histories={tool: [read_table(p, f"{of_tool[tool]}_history") for p in files[f"{tool}_histories"]] for tool in tools},
        fields={name: [read_table(path, f"wheel_{name}") for path in files[name]] for name in ("rim", "rut", "field")},
    )
    write_page(results, Path(snakemake.output.page), Path(snakemake.output.figures[0]).parent)
    write_html(snakemake.output.page, snakemake.output.html)
