# The report: tables and figures of the paper, ours beside the paper's.


rule report:
    input:
        soils=f"{RESULTS}/soil.parquet",
        design=f"{RESULTS}/design.parquet",
        repose=f"{RESULTS}/repose.parquet",
        shear=f"{RESULTS}/shear.parquet",
        strength=f"{RESULTS}/strength.parquet",
        screening=f"{RESULTS}/screening.parquet",
        surrogates=f"{RESULTS}/surrogates.json",
        residuals=f"{RESULTS}/residuals.parquet",
        calibration=f"{RESULTS}/calibration.parquet",
        iterations=f"{RESULTS}/iterations.parquet",
        acceleration=f"{RESULTS}/acceleration.parquet",
        reachability=f"{RESULTS}/reachability.parquet",
        template="workflow/report/template.html.j2",
        figures="workflow/scripts/_figures.py",
        builder="workflow/scripts/_report.py",
    output:
        html=f"{RESULTS}/report.html",
    log:
        f"{LOGS}/report.log",
    params:
        config=config,
        versions=versions(),
    message:
        "Write the report."
    script:
        "../scripts/report.py"
