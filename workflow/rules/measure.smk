# Step 1: measure the real soils.


rule measure_soils:
    input:
        soils=SOIL_FILES,
        # a function: its paths may have braces
        raw=lambda wildcards: raw_files(SOIL_FILES),
        tables=(
            [f"{RESULTS}/{name}.parquet" for name in MEASURED]
            if config["twins"]
            else []
        ),
    output:
        table=f"{RESULTS}/soil.parquet",
    log:
        f"{LOGS}/measure_soils.log",
    params:
        experiments=config["experiments"],
        soils=config["soils"],
        twins=config["twins"],
        design=config["design"],
        material=config["material"],
        code=CODE.of_script("measure_soils", *LABORATORY),
    message:
        "Collect the targets: measured responses of the real soils and of the hidden twins."
    script:
        "../scripts/measure_soils.py"
