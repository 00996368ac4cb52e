# First answer in seconds, without simulations: calibration on the tables of docs/reference, for one soil (--config soil=...) or for
# all soils of the study. For one soil the test may be another one: radius_m, density_kg_m3, gravity_m_s2, lift_speed_m_s.

REFERENCE = file_of_checkout("docs/reference", CHECKOUT)
# Tables of the responses that the reference campaign measured.
IN_REFERENCE = [
    path
    for path in sorted(map(str, Path(REFERENCE).glob("*.parquet")))
    if Path(path).stem in (*BY_NAME, *REDUCED)
]
# Density, gravity and lift speed of the reference campaign.
REFERENCE_TEST = in_words(
    asked.of_reference, file_of_checkout("config/reference.yaml", CHECKOUT)
)
in_words(
    asked.check, FIRST_ANSWER_TEST, REFERENCE_TEST, f"{REFERENCE}/calibration.parquet"
)


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
        asked=FIRST_ANSWER_TEST,
        simulated=REFERENCE_TEST,
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
