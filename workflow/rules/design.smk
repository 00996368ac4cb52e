# Step 3a: choose the parameter sets (screening, grid, radius sweep, checks) and prepare the kernels.


rule design:
    output:
        table=f"{RESULTS}/design.parquet",
    log:
        f"{LOGS}/design.log",
    # first of all, so that `make status` knows what is to come
    priority: 2
    params:
        rows=lambda wildcards, input: DESIGN,
        digest=lambda wildcards: digest(DESIGN),
    message:
        "Expand the design into one row for each result of a point."
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
