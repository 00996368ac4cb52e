# Step 1: measure the real soils.


rule measure_soils:
    input:
        soils=soil_files(config),
        raw=raw_files(soil_files(config)),
        repose=[f"{RESULTS}/repose.parquet"] if config["twins"] else [],
        strength=[f"{RESULTS}/strength.parquet"] if config["twins"] else [],
    output:
        table=f"{RESULTS}/soil.parquet",
    log:
        f"{LOGS}/measure_soils.log",
    params:
        soils=config["soils"],
        twins=config["twins"],
        design=config["design"],
        material=config["material"],
        inference=INFERENCE,
    message:
        "Collect cohesion, friction angle and angle of repose of the real soils, and of hidden twins."
    script:
        "../scripts/measure_soils.py"
