# The report: tables and figures of the paper, ours beside the paper's, and what goes beyond.

REPORTED = [
    *("soil", "design", "repose", "shear", "strength", "screening", "acceleration"),
    *("reachability", "calibration", "iterations", "minima", "posterior"),
    *("equivalents", "identifiability", "verification", "sensitivity", "coverage"),
]


rule report:
    input:
        tables=[f"{RESULTS}/{name}.parquet" for name in REPORTED],
        residuals=f"{LAST}/residuals.parquet",
        surrogates=f"{LAST}/surrogates.json",
        rounds=[
            f"{RESULTS}/rounds/{k}/comparison.parquet" for k in range(1, ROUNDS + 1)
        ],
        twins=[f"{RESULTS}/twins.parquet"] if config["twins"] else [],
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
