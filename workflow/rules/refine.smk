# Beyond the paper: simulate where the optima lie, fit and optimise again. Each round's state is kept in rounds/<k>.


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
        study={
            key: config[key]
            for key in ("material", "design", "repose", "shear", "engine")
        },
        optimise=config["optimise"],
        uncertainty=config["uncertainty"],
        refine={
            key: config["refine"][key] for key in config["refine"] if key != "rounds"
        },
        inference=INFERENCE,
    message:
        "Choose points near the optima of the round before; round {wildcards.round}."
    script:
        "../scripts/refinement_design.py"


rule compare_round:
    input:
        calibration=previous("calibration.parquet"),
        surrogates=previous("surrogates.json"),
        campaign_repose=f"{RESULTS}/repose.parquet",
        campaign_strength=f"{RESULTS}/strength.parquet",
        repose=f"{RESULTS}/rounds/{{round}}/repose.parquet",
        shear=f"{RESULTS}/rounds/{{round}}/shear.parquet",
        strength=f"{RESULTS}/rounds/{{round}}/strength.parquet",
    output:
        table=f"{RESULTS}/rounds/{{round}}/comparison.parquet",
    log:
        f"{LOGS}/rounds/{{round}}/compare_round.log",
    params:
        material=config["material"],
        strength=config["shear"]["strength"],
        normal_stress=config["shear"]["normal_stress"],
        inference=INFERENCE,
    message:
        "Compare the optima of the round before with their simulations; round {wildcards.round}."
    script:
        "../scripts/verify.py"
