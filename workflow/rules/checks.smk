# Checks: what the acceleration costs in accuracy.


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
