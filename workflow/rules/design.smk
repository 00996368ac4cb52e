# Step 3a: choose the parameter sets (screening, grid, radius sweep, checks) and prepare the kernels.


rule design:
    output:
        table=f"{RESULTS}/design.parquet",
    log:
        f"{LOGS}/design.log",
    # first of all, so that `make status` knows what is to come
    priority: 1
    params:
        simulations=lambda wildcards, input: list(SIMULATIONS.values()),
        digest=lambda wildcards: digest(list(SIMULATIONS.values())),
    message:
        "Expand the design into one row per simulation."
    script:
        "../scripts/design.py"


rule compile_kernels:
    output:
        marker=f"{RESULTS}/kernels.txt",
    log:
        f"{LOGS}/compile_kernels.log",
    params:
        engine=ENGINE,
        settings=config["engine"],
    message:
        "Compile the engine's kernels once, before the simulations fan out."
    script:
        "../scripts/compile_kernels.py"
