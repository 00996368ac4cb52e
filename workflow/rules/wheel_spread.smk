# Does it matter under the wheel which of the equivalent soils is taken? Not part of `all`: the first case of the wheel, and soils that
# serve as well. Beds, wheels and plates are jobs of wheel.smk.


localrules:
    measure_spread,
    spread_report,


rule wheel_spread:
    input:
        cost_told("wheel_spread"),
        f"{RESULTS}/wheel_spread.html",


rule measure_spread:
    input:
        beds=spread_files("bed.parquet"),
        runs=spread_files(f"slip_{SPREAD['slip']:g}/run.parquet"),
        histories=spread_files(f"slip_{SPREAD['slip']:g}/history.parquet"),
        plates=(
            []
            if SPREAD_PLATE is None
            else spread_files(f"plate_{SPREAD_PLATE:g}/history.parquet")
        ),
    output:
        table=f"{RESULTS}/wheel_spread.parquet",
    log:
        f"{LOGS}/wheel/measure_spread.log",
    params:
        spread={name: SPREAD[name] for name in SPREAD if name != "measured_ratio"},
        code=CODE.of_script("measure_spread"),
    message:
        "Measure the wheel on beds of the optimum and of soils that serve as well."
    script:
        "../scripts/measure_spread.py"


rule spread_report:
    input:
        table=f"{RESULTS}/wheel_spread.parquet",
    output:
        page=f"{RESULTS}/wheel_spread.md",
        html=f"{RESULTS}/wheel_spread.html",
        answers=f"{RESULTS}/wheel_spread_answer.parquet",
        further=f"{RESULTS}/wheel_spread_further.parquet",
        picture=f"{RESULTS}/wheel/figures/wheel_spread.png",
    log:
        f"{LOGS}/wheel/spread_report.log",
    params:
        case=SPREAD_CASE,
        calibration=ANSWER,
        posterior=f"{RESULTS}/posterior.parquet",
        design=config["design"],
        responses={
            response.column: (
                response.unit,
                config["verify"]["difference_of_consequence"][response.column],
            )
            for experiment in EXPERIMENTS
            for response in experiment.RESPONSES
        },
        measured_ratio=SPREAD["measured_ratio"],
        code=CODE.of_script("spread_report"),
    message:
        "Say whether it matters under the wheel which of the equivalent soils is taken."
    script:
        "../scripts/spread_report.py"
