# The report: tables and figures of the paper with our results, and further analyses.
from virtual_soil.report.contents import (
    ANSWER,
    FIGURES,
    PAGE,
    TABLES,
    figure_names,
    marked,
)
from virtual_soil.report.experiments import repose as recorded
from virtual_soil.report.laboratory import laboratory_of

REPORTED = [
    *("soil", "design", *MEASURED, "screening", "acceleration"),
    *("reachability", "calibration", "iterations", "minima", "posterior"),
    *("equivalents", "identifiability", "verification", "sensitivity", "coverage"),
    *(["equivalents_simulated"] if config["verify"]["equivalents"] else []),
]


# Design row and settings of the simulation whose lift is recorded, if the study has heaps.
LIFT = base_settings(recorded.NAME) if recorded.NAME in TESTS else ({}, {})


# Figures of the study.
SHOWN = figure_names(config, set(laboratory_of(SOIL_FILES)))


rule record_lift:
    input:
        kernels=f"{RESULTS}/kernels.txt",
    output:
        lift=f"{RESULTS}/lift.parquet",
    log:
        f"{LOGS}/record_lift.log",
    resources:
        runtime=lambda wildcards, attempt: runtime_min([LIFT], attempt),
        mem_mb=lambda wildcards, attempt: memory_mb([LIFT], attempt),
    params:
        row=LIFT[0],
        settings=LIFT[1],
        engine=ENGINE,
        code=CODE.of_script("record_lift", module_of(recorded.NAME, "simulate")),
    message:
        "Repeat the heap at the base point and record the lift of the tube."
    script:
        "../scripts/record_lift.py"


rule report:
    input:
        tables=[f"{RESULTS}/{name}.parquet" for name in REPORTED],
        later=[
            f"{RESULTS}{stage}/{name}.parquet"
            for stage in LATER_STAGES
            for name in MEASURED
        ],
        soils=SOIL_FILES,
        # a function: its paths may have braces
        raw=lambda wildcards: raw_files(SOIL_FILES),
        before=simulated_in_all("before.parquet"),
        after=simulated_in_all("after.parquet"),
        histories=simulated_in_all("history.parquet"),
        lift=[f"{RESULTS}/lift.parquet"] if recorded.NAME in TESTS else [],
        residuals=f"{LAST}/residuals.parquet",
        surrogates=f"{LAST}/surrogates.json",
        rounds=[
            f"{RESULTS}/rounds/{k}/comparison.parquet" for k in range(1, ROUNDS + 1)
        ],
        twins=[f"{RESULTS}/twins.parquet"] if config["twins"] else [],
        page=[
            file_of_checkout(f"src/virtual_soil/report/{name}", CHECKOUT)
            for name in PAGE
        ],
        captions=[
            file_of_checkout(f"src/virtual_soil/report/captions/{name}.rst", CHECKOUT)
            for name in (*SHOWN, *TABLES)
        ],
    output:
        html=marked(f"{RESULTS}/report.html", ANSWER, "The whole report"),
        figures=[
            marked(f"{RESULTS}/figures/{name}.svg", *FIGURES[name]) for name in SHOWN
        ],
        data=[f"{RESULTS}/figures/{name}.csv" for name in SHOWN],
        tables=[
            marked(f"{RESULTS}/tables/{name}.csv", *entry)
            for name, entry in TABLES.items()
        ],
    log:
        f"{LOGS}/report.log",
    params:
        config=config,
        versions=versions(),
        code=CODE.of_script("report", *DESCRIBED),
    message:
        "Write the report with its figures and tables."
    script:
        "../scripts/report.py"
