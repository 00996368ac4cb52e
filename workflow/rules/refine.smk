# Beyond the paper: simulate near the optima, then fit and optimise again. Each round's tables are kept in rounds/<k>.


checkpoint refinement_design:
    input:
        minima=previous("minima.parquet"),
        surrogates=previous("surrogates.json"),
        soils=f"{RESULTS}/soil.parquet",
        comparison=lambda wildcards: (
            [] if wildcards.round == "1" else previous("comparison.parquet")(wildcards)
        ),
    output:
        table=f"{RESULTS}/rounds/{{round}}/design.parquet",
    log:
        f"{LOGS}/rounds/{{round}}/refinement_design.log",
    params:
        study={key: config[key] for key in SIMULATED_BY},
        optimise=config["optimise"],
        uncertainty=config["uncertainty"],
        refine={
            key: config["refine"][key] for key in config["refine"] if key != "rounds"
        },
        code=CODE.of_script("refinement_design"),
    message:
        "Choose points near the optima of the previous round; round {wildcards.round}."
    script:
        "../scripts/refinement_design.py"


rule compare_round:
    input:
        calibration=previous("calibration.parquet"),
        surrogates=previous("surrogates.json"),
        soils=f"{RESULTS}/soil.parquet",
        campaign=[f"{RESULTS}/{name}.parquet" for name in MEASURED],
        tables=[f"{RESULTS}/rounds/{{round}}/{name}.parquet" for name in MEASURED],
    output:
        table=f"{RESULTS}/rounds/{{round}}/comparison.parquet",
    log:
        f"{LOGS}/rounds/{{round}}/compare_round.log",
    params:
        **COMPARED_BY,
        code=CODE.of_script("verify"),
    message:
        "Compare the optima of the previous round with their simulations; round {wildcards.round}."
    script:
        "../scripts/verify.py"
