# Checks: accuracy of the accelerated simulations.


rule check_acceleration:
    input:
        tables=[f"{RESULTS}/{name}.parquet" for name in TESTS],
    output:
        table=f"{RESULTS}/acceleration.parquet",
    log:
        f"{LOGS}/check_acceleration.log",
    params:
        code=CODE.of_script("check_acceleration"),
    message:
        "Compare the accelerated simulations with the paper's fidelity, relative to the scatter between seeds."
    script:
        "../scripts/check_acceleration.py"
