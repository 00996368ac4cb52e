# Step 2: which grain parameters matter.


rule screening:
    input:
        repose=f"{RESULTS}/repose.parquet",
    output:
        table=f"{RESULTS}/screening.parquet",
    log:
        f"{LOGS}/screening.log",
    params:
        material=config["material"],
        screening=config["screening"],
        inference=INFERENCE,
    message:
        "Compare the angle of repose after one change at a time with the base set (Table 2)."
    script:
        "../scripts/screening.py"
