# Step 3a: choose the parameter sets (screening, grid, radius sweep, checks) and compile the kernels.


rule design:
    output:
        table=f"{RESULTS}/design.parquet",
    log:
        f"{LOGS}/design.log",
    # runs first: `make status` reads the design
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
        adhesion=adhesion_laws(config),
        clumps=config["shape"] is not None,
        turning=any(experiment.TURNING for experiment in chosen(config["experiments"])),
        code=CODE.of_script("compile_kernels"),
    message:
        "Compile the engine's kernels once, before the simulations start."
    script:
        "../scripts/compile_kernels.py"
