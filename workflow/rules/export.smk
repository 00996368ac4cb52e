# Exports: a material card and input files for other DEM programs, one folder per case.


rule export:
    input:
        calibration=f"{RESULTS}/calibration.parquet",
        verification=f"{RESULTS}/verification.parquet",
        templates=EXPORT_TEMPLATES,
    output:
        card=f"{RESULTS}/export/{{case}}/material.json",
        inputs=[
            f"{RESULTS}/export/{{case}}/{name}" for name in EXPORT_FILES + CLUMP_FILES
        ],
    log:
        f"{LOGS}/export/{{case}}.log",
    params:
        config=config,
        provenance={
            "engine": ENGINE,
            "inference": CODE.of_package("src/virtual_soil/calibration"),
            "export": CODE.of_package("src/virtual_soil/exports"),
            "versions": versions(),
        },
        code=CODE.of_script("export"),
    message:
        "Write the material card and the input files for other DEM programs; case {wildcards.case}."
    script:
        "../scripts/export.py"
