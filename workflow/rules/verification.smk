# Verification of the engine: published and closed-form results, and the page that lists them. Not part of a study.

GROUPS = [
    *("normal_impact", "oblique_impact", "friction"),
    *("conservation", "invariance", "rest"),
]
FIGURES = ["restitution", "oblique_impact"]
VERIFICATION = fingerprint("src/verification")


wildcard_constraints:
    group="|".join(GROUPS),


rule verification:
    input:
        "docs/verification.md",


rule verify_engine:
    output:
        table="results/verification/{group}.parquet",
    log:
        "logs/verification/{group}.log",
    params:
        engine=ENGINE,
        cases=VERIFICATION,
    message:
        "Compare the engine with published and closed-form results: {wildcards.group}."
    script:
        "../scripts/verify_engine.py"


rule verification_page:
    input:
        tables=expand("results/verification/{group}.parquet", group=GROUPS),
    output:
        page="docs/verification.md",
        figures=expand("docs/verification/{figure}.png", figure=FIGURES),
    log:
        "logs/verification/page.log",
    params:
        groups=GROUPS,
        cases=VERIFICATION,
    message:
        "Write the verification page."
    script:
        "../scripts/verification_page.py"
