# Angle of repose: lift the tube, look at the heap.


rule simulate_repose:
    input:
        kernels=f"{RESULTS}/kernels.txt",
    output:
        grains=f"{RESULTS}/sims/repose/{{batch}}/grains.parquet",
        filled=f"{RESULTS}/sims/repose/{{batch}}/filled.parquet",
        run=f"{RESULTS}/sims/repose/{{batch}}/run.parquet",
        timing=f"{RESULTS}/sims/repose/{{batch}}/timing.json",
    log:
        f"{LOGS}/repose/{{batch}}.log",
    # the long jobs first, so that at the end no core waits for one of them
    priority: 1
    threads: 1
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=batch_runtime("repose"),
        mem_mb=batch_memory("repose"),
    params:
        members=members("repose"),
        digest=members_digest("repose"),
        engine=ENGINE,
        checkpoints=f"{RESULTS}/checkpoints",
    message:
        "Fill the tube, lift it, and let the heap come to rest: {wildcards.batch}."
    script:
        "../scripts/simulate_repose.py"


rule measure_repose:
    input:
        runs=simulated("repose", "run.parquet"),
        grains=simulated("repose", "grains.parquet"),
        timings=simulated("repose", "timing.json"),
        design=f"{RESULTS}{{stage}}/design.parquet",
    output:
        table=f"{RESULTS}{{stage}}/repose.parquet",
    log:
        f"{LOGS}{{stage}}/measure_repose.log",
    params:
        estimator=config["repose"]["estimator"],
        estimators=ESTIMATORS,
    message:
        "Measure the angle of repose of every heap by two independent estimators."
    script:
        "../scripts/measure_repose.py"
