# Step 2: which grain parameters matter.


rule screening:
    input:
        runs=f"{RESULTS}/{RESPONSES[config['screening']['response']].table}.parquet",
    output:
        table=f"{RESULTS}/screening.parquet",
    log:
        f"{LOGS}/screening.log",
    params:
        material=config["material"],
        screening=config["screening"],
        code=CODE.of_script("screening"),
    message:
        "Compare a response after one change at a time with the base set (Table 2)."
    script:
        "../scripts/screening.py"
