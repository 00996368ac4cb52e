# Beyond the paper: uncertainty of the calibration, and comparison of the predictions with simulations of the optima.


rule uncertainty:
    input:
        surrogates=f"{LAST}/surrogates.json",
        calibration=f"{LAST}/calibration.parquet",
        soils=f"{RESULTS}/soil.parquet",
    output:
        posterior=f"{RESULTS}/posterior.parquet",
        equivalents=f"{RESULTS}/equivalents.parquet",
        identifiability=f"{RESULTS}/identifiability.parquet",
    log:
        f"{LOGS}/uncertainty.log",
    params:
        experiments=config["experiments"],
        optimise=config["optimise"],
        design=config["design"],
        uncertainty=config["uncertainty"],
        code=CODE.of_script("uncertainty"),
    message:
        "Sample the posterior of the grain parameters of each soil, given all known errors."
    script:
        "../scripts/uncertainty.py"


rule sensitivity:
    input:
        surrogates=f"{LAST}/surrogates.json",
    output:
        table=f"{RESULTS}/sensitivity.parquet",
    log:
        f"{LOGS}/sensitivity.log",
    params:
        design=config["design"],
        code=CODE.of_script("sensitivity"),
    message:
        "Attribute the variance of every response to the design variables (Sobol indices)."
    script:
        "../scripts/sensitivity.py"


rule check_coverage:
    input:
        surrogates=f"{LAST}/surrogates.json",
        soils=f"{RESULTS}/soil.parquet",
    output:
        table=f"{RESULTS}/coverage.parquet",
    log:
        f"{LOGS}/check_coverage.log",
    params:
        experiments=config["experiments"],
        design=config["design"],
        twins=config["twins"],
        code=CODE.of_script("check_coverage"),
    message:
        "Calibrate soils whose parameters are known and count how often the stated regions contain them."
    script:
        "../scripts/check_coverage.py"


rule twins:
    input:
        surrogates=f"{LAST}/surrogates.json",
        calibration=f"{LAST}/calibration.parquet",
        posterior=f"{RESULTS}/posterior.parquet",
        soils=f"{RESULTS}/soil.parquet",
    output:
        table=f"{RESULTS}/twins.parquet",
    log:
        f"{LOGS}/twins.log",
    params:
        twins=config["twins"],
        experiments=config["experiments"],
        optimise=config["optimise"],
        design=config["design"],
        uncertainty=config["uncertainty"],
        code=CODE.of_script("twins"),
    message:
        "Compare the true parameters of the hidden twins with the calibrated ones."
    script:
        "../scripts/twins.py"


checkpoint verification_design:
    input:
        calibration=f"{LAST}/calibration.parquet",
        equivalents=(
            f"{RESULTS}/equivalents.parquet" if config["verify"]["equivalents"] else []
        ),
    output:
        table=f"{RESULTS}/verification/design.parquet",
    log:
        f"{LOGS}/verification_design.log",
    params:
        study={key: config[key] for key in SIMULATED_BY},
        verify=FIRST_SEEDS,
        n_sets=config["verify"]["equivalents"],
        code=CODE.of_script("verification_design"),
    message:
        "List the simulations of every optimum and of some equivalent sets, with seeds that no fit has used."
    script:
        "../scripts/verification_design.py"


# What the seeds so far decide, before each round of further seeds.
rule compare_seeds:
    input:
        calibration=f"{LAST}/calibration.parquet",
        surrogates=f"{LAST}/surrogates.json",
        soils=f"{RESULTS}/soil.parquet",
        campaign=[f"{RESULTS}/{name}.parquet" for name in MEASURED],
        tables=lambda wildcards: verified(int(wildcards.more) - 1),
    output:
        table=f"{RESULTS}/verification/{{more}}/comparison.parquet",
    log:
        f"{LOGS}/verification/{{more}}/compare_seeds.log",
    params:
        **COMPARED_BY,
        code=CODE.of_script("verify"),
    message:
        "Compare the optima with their simulations so far, before round {wildcards.more} of further seeds."
    script:
        "../scripts/verify.py"


checkpoint more_seeds:
    input:
        calibration=f"{LAST}/calibration.parquet",
        comparison=f"{RESULTS}/verification/{{more}}/comparison.parquet",
    output:
        table=f"{RESULTS}/verification/{{more}}/design.parquet",
    log:
        f"{LOGS}/verification/{{more}}/more_seeds.log",
    params:
        study={key: config[key] for key in SIMULATED_BY},
        verify=FIRST_SEEDS,
        code=CODE.of_script("more_seeds"),
    message:
        "List further seeds for the optima that are not decided; round {wildcards.more}."
    script:
        "../scripts/more_seeds.py"


rule verify:
    input:
        calibration=f"{LAST}/calibration.parquet",
        surrogates=f"{LAST}/surrogates.json",
        soils=f"{RESULTS}/soil.parquet",
        campaign=[f"{RESULTS}/{name}.parquet" for name in MEASURED],
        tables=verified(MORE_SEEDS),
    output:
        table=f"{RESULTS}/verification.parquet",
    log:
        f"{LOGS}/verify.log",
    params:
        **COMPARED_BY,
        code=CODE.of_script("verify"),
    message:
        "Compare the predicted responses of the optima with their simulations."
    script:
        "../scripts/verify.py"


# Sets that serve as well as the best: do they, simulated?
rule verify_equivalents:
    input:
        calibration=f"{LAST}/calibration.parquet",
        equivalents=f"{RESULTS}/equivalents.parquet",
        surrogates=f"{LAST}/surrogates.json",
        soils=f"{RESULTS}/soil.parquet",
        campaign=[f"{RESULTS}/{name}.parquet" for name in MEASURED],
        tables=verified(0),
    output:
        table=f"{RESULTS}/equivalents_simulated.parquet",
    log:
        f"{LOGS}/verify_equivalents.log",
    params:
        **COMPARED_BY,
        n_sets=config["verify"]["equivalents"],
        code=CODE.of_script("verify"),
    message:
        "Compare equivalent parameter sets with their simulations."
    script:
        "../scripts/verify.py"


rule conclude:
    input:
        calibration=f"{LAST}/calibration.parquet",
        iterations=f"{LAST}/iterations.parquet",
        minima=f"{LAST}/minima.parquet",
        surrogates=f"{LAST}/surrogates.json",
        published_calibration=f"{RESULTS}/as_published/calibration.parquet",
        published_iterations=f"{RESULTS}/as_published/iterations.parquet",
        published_minima=f"{RESULTS}/as_published/minima.parquet",
        soils=f"{RESULTS}/soil.parquet",
        posterior=f"{RESULTS}/posterior.parquet",
        verification=f"{RESULTS}/verification.parquet",
    output:
        calibration=f"{RESULTS}/calibration.parquet",
        iterations=f"{RESULTS}/iterations.parquet",
        minima=f"{RESULTS}/minima.parquet",
        surrogates=f"{RESULTS}/surrogates.json",
    log:
        f"{LOGS}/conclude.log",
    params:
        experiments=config["experiments"],
        optimise=config["optimise"],
        design=config["design"],
        uncertainty=config["uncertainty"],
        code=CODE.of_script("conclude"),
    message:
        "Combine the optima with their intervals and with the verdicts of their simulations."
    script:
        "../scripts/conclude.py"
