# Angle of repose: lift the tube, look at the heap.


rule simulate_repose:
    input:
        kernels=f"{RESULTS}/kernels.txt",
    output:
        grains=f"{RESULTS}/sims/repose/{{simulation}}/grains.parquet",
        filled=f"{RESULTS}/sims/repose/{{simulation}}/filled.parquet",
        run=f"{RESULTS}/sims/repose/{{simulation}}/run.parquet",
        timing=f"{RESULTS}/sims/repose/{{simulation}}/timing.json",
    log:
        f"{LOGS}/repose/{{simulation}}.log",
    threads: 1
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=simulation_runtime,
        mem_mb=simulation_memory,
    params:
        row=simulation_row,
        settings=simulation_settings,
        engine=ENGINE,
        checkpoint=f"{RESULTS}/checkpoints/{{simulation}}.npz",
    message:
        "Fill the tube, lift it, and let the heap come to rest: simulation {wildcards.simulation}."
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
