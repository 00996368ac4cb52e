# Step 3b: fit f(mu_s, mu_r) g(r) and a Gaussian process to each response; repeated in every round of refinement.


rule fit_surrogates:
    input:
        tables=known_tables,
    output:
        surrogates=f"{RESULTS}/rounds/{{round}}/surrogates.json",
        residuals=f"{RESULTS}/rounds/{{round}}/residuals.parquet",
    log:
        f"{LOGS}/rounds/{{round}}/fit_surrogates.log",
    params:
        experiments=config["experiments"],
        design=config["design"],
        material=config["material"],
        surrogate=config["surrogate"],
        code=CODE.of_script("fit_surrogates"),
    message:
        "Fit the surrogates of all responses (Equation 3); round {wildcards.round}."
    script:
        "../scripts/fit_surrogates.py"
