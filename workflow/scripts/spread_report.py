"""Adapt rule `spread_report` to `virtual_soil.wheel.spread_page`."""

from pathlib import Path

from _log import log_to
from virtual_soil.campaign.tables import read_table, write_table
from virtual_soil.report.html_page import write_html
from virtual_soil.wheel.spread_page import answer_table, further_table, write_page
from virtual_soil.wheel.spread_runs import done_runs, family_of

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params, output = dict(snakemake.params.items()), snakemake.output
    runs = done_runs(read_table(snakemake.input.table, "wheel_spread"))
    where = (params["calibration"], params["posterior"])
    family = family_of(params["case"], runs, *where, params["design"], params["responses"])
    answers, further = answer_table(runs, family), further_table(runs, family, params["measured_ratio"])
    source = {"rule": snakemake.rule, **params}
    write_table(answers, output.answers, "wheel_spread_answer", source)
    write_table(further, output.further, "wheel_spread_further", source)
    write_page(runs, family, answers, further, Path(output.page), Path(output.picture))
    write_html(output.page, output.html)
