# Step 4: find the grain parameters whose responses match the targets.


rule reachability:
    input:
        surrogates=f"{RESULTS}/rounds/0/surrogates.json",
        tables=[f"{RESULTS}/{name}.parquet" for name in MEASURED],
        soils=f"{RESULTS}/soil.parquet",
    output:
        table=f"{RESULTS}/reachability.parquet",
    log:
        f"{LOGS}/reachability.log",
    params:
        experiments=config["experiments"],
        design=config["design"],
        uncertainty=config["uncertainty"],
        code=CODE.of_script("reachability"),
    message:
        "Compare every target with the range of its response over the design."
    script:
        "../scripts/reachability.py"


rule calibrate:
    input:
        surrogates=f"{RESULTS}/rounds/{{round}}/surrogates.json",
        soils=f"{RESULTS}/soil.parquet",
        reachability=f"{RESULTS}/reachability.parquet",
    output:
        calibration=f"{RESULTS}/rounds/{{round}}/calibration.parquet",
        iterations=f"{RESULTS}/rounds/{{round}}/iterations.parquet",
        minima=f"{RESULTS}/rounds/{{round}}/minima.parquet",
    log:
        f"{LOGS}/rounds/{{round}}/calibrate.log",
    params:
        experiments=config["experiments"],
        optimise=config["optimise"],
        design=config["design"],
        uncertainty=config["uncertainty"],
        floors=FLOORS,
        code=CODE.of_script("calibrate"),
    message:
        "Optimise the design variables of every case; round {wildcards.round}."
    script:
        "../scripts/calibrate.py"


rule calibrate_as_published:
    input:
        surrogates=f"{RESULTS}/rounds/0/surrogates.json",
        soils=f"{RESULTS}/soil.parquet",
    output:
        calibration=f"{RESULTS}/as_published/calibration.parquet",
        iterations=f"{RESULTS}/as_published/iterations.parquet",
        minima=f"{RESULTS}/as_published/minima.parquet",
    log:
        f"{LOGS}/calibrate_as_published.log",
    params:
        experiments=config["experiments"],
        optimise=config["optimise"],
        design=config["design"],
        printed=AS_PRINTED,
        code=CODE.of_script("calibrate_as_published"),
    message:
        "Optimise with the paper's method, on the polynomials fitted to our campaign and on the published ones."
    script:
        "../scripts/calibrate_as_published.py"
