"""Adapt checkpoint `more_seeds` to `calibration.undecided` and `campaign.design.decisive`."""

from _log import log_to
from virtual_soil.calibration.verify import undecided
from virtual_soil.campaign.design import decisive
from virtual_soil.campaign.experiments.registry import BY_RESPONSE
from virtual_soil.campaign.inference import optima
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    study, files = snakemake.params.study, snakemake.input
    at = optima(read_table(files.calibration, "optima"), study["design"]["variables"])
    questions = {
        case: (at[case], sorted({BY_RESPONSE[name].NAME for name in names}))
        for case, names in undecided(read_table(files.comparison, "verification")).items()
    }
    for case, (_, tests) in questions.items():
        print(f"{case} is not decided; more seeds of {', '.join(tests)}")
    table = decisive(study, questions, snakemake.params.verify, int(snakemake.wildcards.more))
    write_table(table, snakemake.output.table, "design", {"rule": snakemake.rule})
