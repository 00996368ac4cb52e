# Step 3b: fit f(mu_s, mu_r) g(r) for each property.


rule fit_surrogates:
    input:
        repose=f"{RESULTS}/repose.parquet",
        strength=f"{RESULTS}/strength.parquet",
    output:
        surrogates=f"{RESULTS}/surrogates.json",
        residuals=f"{RESULTS}/residuals.parquet",
    log:
        f"{LOGS}/fit_surrogates.log",
    params:
        design=config["design"],
        material=config["material"],
        surrogate=config["surrogate"],
        inference=INFERENCE,
    message:
        "Fit the surrogates of cohesion, friction angle and angle of repose (Equation 3)."
    script:
        "../scripts/fit_surrogates.py"
