"""The campaign without Snakemake: configuration, design, simulations, and tables of the measured responses."""
