# Checks: what the acceleration costs in accuracy, and which targets can be reached at all.


rule check_acceleration:
    input:
        repose=f"{RESULTS}/repose.parquet",
        shear=f"{RESULTS}/shear.parquet",
    output:
        table=f"{RESULTS}/acceleration.parquet",
    log:
        f"{LOGS}/check_acceleration.log",
    params:
        inference=INFERENCE,
    message:
        "Compare the accelerated simulations with the paper's fidelity, beside the seeds' scatter."
    script:
        "../scripts/check_acceleration.py"


rule reachability:
    input:
        repose=f"{RESULTS}/repose.parquet",
        strength=f"{RESULTS}/strength.parquet",
        soils=f"{RESULTS}/soil.parquet",
    output:
        table=f"{RESULTS}/reachability.parquet",
    log:
        f"{LOGS}/reachability.log",
    params:
        inference=INFERENCE,
    message:
        "Compare every target with the range of the simulated responses."
    script:
        "../scripts/reachability.py"
