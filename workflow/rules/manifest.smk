# Manifest of a finished study, and the comparison of its files with it.


rule manifest:
    input:
        report=f"{RESULTS}/report.html",
        calibration=f"{RESULTS}/calibration.parquet",
        exports=expand(f"{RESULTS}/export/{{case}}/material.json", case=CASES),
    output:
        manifest=f"{RESULTS}/manifest.sha256",
    log:
        f"{LOGS}/manifest.log",
    params:
        code=CODE.of_script("manifest"),
    message:
        "List every file of the finished study with its SHA-256 checksum."
    script:
        "../scripts/manifest.py"


# No input: Snakemake could rebuild an input first, and a manually changed file would then enter a new manifest.
rule check_manifest:
    log:
        f"{LOGS}/check_manifest.log",
    params:
        folder=RESULTS,
        code=CODE.of_script("check_manifest"),
    message:
        "Compare every file of the study with the manifest."
    script:
        "../scripts/check_manifest.py"
