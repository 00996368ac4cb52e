# Step 3: the virtual tests. Every experiment is simulated and measured. Responses that need several runs are then reduced.


rule simulate:
    input:
        kernels=f"{RESULTS}/kernels.txt",
    output:
        before=f"{RESULTS}/sims/{{experiment}}/{{batch}}/before.parquet",
        after=f"{RESULTS}/sims/{{experiment}}/{{batch}}/after.parquet",
        history=f"{RESULTS}/sims/{{experiment}}/{{batch}}/history.parquet",
        run=f"{RESULTS}/sims/{{experiment}}/{{batch}}/run.parquet",
        timing=f"{RESULTS}/sims/{{experiment}}/{{batch}}/timing.json",
    log:
        f"{LOGS}/{{experiment}}/{{batch}}.log",
    # long jobs first: otherwise cores are idle at the end
    priority: 1
    threads: 1
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=batch_runtime,
        mem_mb=batch_memory,
    params:
        members=members,
        digest=members_digest,
        engine=ENGINE,
        checkpoints=f"{RESULTS}/checkpoints",
        code=code_with("simulate", "simulate"),
    message:
        "Simulate the {wildcards.experiment} tests of {wildcards.batch}."
    script:
        "../scripts/simulate.py"


rule measure:
    input:
        runs=simulated("run.parquet"),
        results=measured_from,
        timings=simulated("timing.json"),
        design=f"{RESULTS}{{stage}}/design.parquet",
    output:
        table=f"{RESULTS}{{stage}}/{{experiment}}.parquet",
    log:
        f"{LOGS}{{stage}}/measure_{{experiment}}.log",
    params:
        settings=lambda wildcards: settings_for(
            BY_NAME[wildcards.experiment], "MEASURED_BY"
        ),
        code=code_with("measure", "measure"),
    message:
        "Measure the responses of every {wildcards.experiment} test."
    script:
        "../scripts/measure.py"


rule reduce:
    input:
        runs=lambda wildcards: f"{RESULTS}{wildcards.stage}/{REDUCED[wildcards.reduced].NAME}.parquet",
    output:
        table=f"{RESULTS}{{stage}}/{{reduced}}.parquet",
    log:
        f"{LOGS}{{stage}}/{{reduced}}.log",
    params:
        experiment=lambda wildcards: REDUCED[wildcards.reduced].NAME,
        settings=lambda wildcards: settings_for(
            REDUCED[wildcards.reduced], "REDUCED_BY"
        ),
        code=lambda wildcards: CODE.of_script(
            "reduce", module_of(REDUCED[wildcards.reduced].NAME, "measure")
        ),
    message:
        "Determine the {wildcards.reduced} of every design point from its runs."
    script:
        "../scripts/reduce.py"
