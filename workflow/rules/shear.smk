# Direct shear: consolidate the slice under a lid, shear it, fit the strength line.


rule simulate_shear:
    input:
        kernels=f"{RESULTS}/kernels.txt",
    output:
        history=f"{RESULTS}/sims/shear/{{batch}}/history.parquet",
        before=f"{RESULTS}/sims/shear/{{batch}}/grains_before.parquet",
        after=f"{RESULTS}/sims/shear/{{batch}}/grains_after.parquet",
        run=f"{RESULTS}/sims/shear/{{batch}}/run.parquet",
        timing=f"{RESULTS}/sims/shear/{{batch}}/timing.json",
    log:
        f"{LOGS}/shear/{{batch}}.log",
    threads: 1
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=batch_runtime("shear"),
        mem_mb=batch_memory("shear"),
    params:
        members=members("shear"),
        digest=members_digest("shear"),
        engine=ENGINE,
        checkpoints=f"{RESULTS}/checkpoints",
    message:
        "Consolidate the slice and shear it: {wildcards.batch}."
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
