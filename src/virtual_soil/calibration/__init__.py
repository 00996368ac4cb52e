"""Inference: from simulated responses to the grain parameters of a real soil. Knows nothing of grains, kernels or Snakemake.

Import from the modules: `optimise.calibrate`, `models.fit_all`, `uncertainty.likelihood_of`, `verify.comparison_table`, ...
"""
