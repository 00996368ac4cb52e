# Step 4: find the grain parameters whose soil behaves like the real one.


rule calibrate:
    input:
        surrogates=f"{RESULTS}/surrogates.json",
        soils=f"{RESULTS}/soil.parquet",
    output:
        calibration=f"{RESULTS}/calibration.parquet",
        iterations=f"{RESULTS}/iterations.parquet",
        minima=f"{RESULTS}/minima.parquet",
    log:
        f"{LOGS}/calibrate.log",
    params:
        optimise=config["optimise"],
        design=config["design"],
        inference=INFERENCE,
    message:
        "Optimise the design variables of every case, on our surrogates and on the published ones."
    script:
        "../scripts/calibrate.py"
