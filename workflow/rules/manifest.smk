# What a finished study consists of, and whether it is still so.


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
        "List every file of the finished study with its SHA-256."
    script:
        "../scripts/manifest.py"


# No input: what a rule reads may be made anew first, and a file that was changed by hand would go into a new manifest.
rule check_manifest:
    log:
        f"{LOGS}/check_manifest.log",
    params:
        folder=RESULTS,
        code=CODE.of_script("check_manifest"),
    message:
        "Compare every file of the study with its manifest."
    script:
        "../scripts/check_manifest.py"
