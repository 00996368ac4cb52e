# First answer in seconds, without simulations: calibration on the tables of docs/reference, for one soil (--config soil=...) or for
# all soils of the study.

REFERENCE = file_of_checkout("docs/reference", CHECKOUT)
# Tables of the responses that the reference campaign measured.
IN_REFERENCE = [
    path
    for path in sorted(map(str, Path(REFERENCE).glob("*.parquet")))
    if Path(path).stem in (*BY_NAME, *REDUCED)
]


rule estimate_from_reference:
    input:
        surrogates=f"{REFERENCE}/surrogates.json",
        calibration=f"{REFERENCE}/calibration.parquet",
        verification=f"{REFERENCE}/verification.parquet",
        tables=IN_REFERENCE,
        soil=lambda wildcards: FIRST_ANSWERS[wildcards.soil],
        raw=lambda wildcards: raw_files([FIRST_ANSWERS[wildcards.soil]]),
    output:
        table="results/first_answer/{soil}.parquet",
        text="results/first_answer/{soil}.txt",
    log:
        "logs/first_answer/{soil}.log",
    params:
        optimise=config["optimise"],
        uncertainty=config["uncertainty"],
        floors=FLOORS,
        code=CODE.of_script("estimate_from_reference", *LABORATORY),
    message:
        "Calibrate {wildcards.soil} on the reference tables, without simulations."
    script:
        "../scripts/estimate_from_reference.py"


rule first_answer:
    input:
        expand("results/first_answer/{soil}.txt", soil=FIRST_ANSWERS),
    log:
        "logs/first_answer/print.log",
    message:
        "Print the first answers; their tables are in results/first_answer."
    shell:
        "cat {input} 2> {log}"
