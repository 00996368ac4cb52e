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
        code=CODE.of_script("design"),
    message:
        "List every simulation of the design."
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
        code=CODE.of_script("compile_kernels"),
    message:
        "Compile the engine's kernels once, before the simulations fan out."
    script:
        "../scripts/compile_kernels.py"
