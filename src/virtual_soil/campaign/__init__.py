"""The campaign without Snakemake: from a checked configuration to simulations and the tables of what they measured."""
