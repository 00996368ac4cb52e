"""Adapt checkpoint `refinement_design` to `calibration.propose`."""

from types import SimpleNamespace

from _log import log_to
from virtual_soil.calibration.refine import propose, settled
from virtual_soil.campaign.design import SEED_KEYS, SEED_STEP, further
from virtual_soil.campaign.inference import likelihoods_of
from virtual_soil.campaign.tables import read_table, write_table


def main(files, params, round_number, output):
    study, refine = params.study, params.refine
    shared = SimpleNamespace(
        experiments=study["experiments"], design=study["design"], uncertainty=params.uncertainty, optimise=params.optimise
    )
    likelihoods = likelihoods_of(files, shared)
    done = set()
    if files.comparison:
        done = settled(read_table(files.comparison, "verification"), refine["tolerance_ratio"])
    points = []
    minima = read_table(files.minima, "minima").sort_values("rank")
    for case, likelihood in likelihoods.items():
        if case in done:
            print(f"{case} is settled")
        else:
            found = minima.loc[minima["case"] == case, study["design"]["variables"]].astype(float)
            points += propose(found.to_dict("records"), likelihood, refine["points_per_case"])
    step = SEED_STEP * (round_number - 1)
    seeds = {key: [seed + step for seed in refine[key]] for key in SEED_KEYS.values()}
    write_table(further(study, "refinement", points, seeds), output.table, "design", {"rule": "refinement_design"})


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.input, snakemake.params, int(snakemake.wildcards.round), snakemake.output)
