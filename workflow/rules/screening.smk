# Step 2: screen the influence of the grain parameters.


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
        printed=BY_RESPONSE[config["screening"]["response"]] in AS_PRINTED,
        code=CODE.of_script("screening"),
    message:
        "Change one grain parameter at a time and compare the response with the base set (Table 2)."
    script:
        "../scripts/screening.py"
