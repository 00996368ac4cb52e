# Step 1: measure the real soils.


rule measure_soils:
    input:
        soils=soil_files(config),
    output:
        table=f"{RESULTS}/soil.parquet",
    log:
        f"{LOGS}/measure_soils.log",
    params:
        soils=config["soils"],
        inference=INFERENCE,
    message:
        "Collect cohesion, friction angle and angle of repose of the real soils."
    script:
        "../scripts/measure_soils.py"
