# Direct shear: consolidate the slice under a lid, shear it, fit the strength line.


rule simulate_shear:
    input:
        kernels=f"{RESULTS}/kernels.txt",
    output:
        history=f"{RESULTS}/sims/shear/{{simulation}}/history.parquet",
        before=f"{RESULTS}/sims/shear/{{simulation}}/grains_before.parquet",
        after=f"{RESULTS}/sims/shear/{{simulation}}/grains_after.parquet",
        run=f"{RESULTS}/sims/shear/{{simulation}}/run.parquet",
        timing=f"{RESULTS}/sims/shear/{{simulation}}/timing.json",
    log:
        f"{LOGS}/shear/{{simulation}}.log",
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
        "Consolidate the slice and shear it: simulation {wildcards.simulation}."
    script:
        "../scripts/simulate_shear.py"


rule measure_shear:
    input:
        runs=simulated("shear", "run.parquet"),
        histories=simulated("shear", "history.parquet"),
        timings=simulated("shear", "timing.json"),
        design=f"{RESULTS}{{stage}}/design.parquet",
    output:
        table=f"{RESULTS}{{stage}}/shear.parquet",
    log:
        f"{LOGS}{{stage}}/measure_shear.log",
    params:
        estimators=ESTIMATORS,
    message:
        "Read peak and plateau strength off every shear curve."
    script:
        "../scripts/measure_shear.py"


rule strength:
    input:
        shear=f"{RESULTS}{{stage}}/shear.parquet",
    output:
        table=f"{RESULTS}{{stage}}/strength.parquet",
    log:
        f"{LOGS}{{stage}}/strength.log",
    params:
        strength=config["shear"]["strength"],
        normal_stress=config["shear"]["normal_stress"],
        inference=INFERENCE,
    message:
        "Fit the Mohr-Coulomb line of every design point: cohesion and friction angle with their errors."
    script:
        "../scripts/strength.py"
