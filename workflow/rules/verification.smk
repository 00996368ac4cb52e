# Verification of the engine against published and closed-form results, and the page that lists them. Not part of a study.

GROUPS = [
    *("normal_impact", "oblique_impact", "friction"),
    *(
        "conservation",
        "invariance",
        "rest",
        "energy",
        "adhesion",
        "clumps",
        "bodies",
        "strength",
    ),
]
# Parts into which the heaps and shear tests over many seeds are divided.
BULK_PARTS = range(16)
# Written by `make check-peers`, which needs LIGGGHTS.
PEERS = [
    "results/verification/peers.parquet",
    "results/verification/peers_adhesion.parquet",
]
FIGURES = ["restitution", "oblique_impact", "bulk"]
VERIFICATION = CODE.of_package("src/virtual_soil/verification")


wildcard_constraints:
    group="|".join(GROUPS),
    part=r"\d+",


# The page is kept in the repository; the tables behind it are not, so that a new checkout makes them and then the page.
rule verification:
    input:
        "docs/verification.md",
        expand("results/verification/{group}.parquet", group=[*GROUPS, "bulk"]),


rule check_engine:
    output:
        table="results/verification/{group}.parquet",
    log:
        "logs/verification/{group}.log",
    params:
        engine=ENGINE,
        cases=VERIFICATION,
        code=CODE.of_script("check_engine"),
    message:
        "Compare the engine with published and closed-form results; group {wildcards.group}."
    script:
        "../scripts/check_engine.py"


rule check_bulk_part:
    output:
        table="results/verification/bulk/{part}.parquet",
    log:
        "logs/verification/bulk/{part}.log",
    params:
        engine=ENGINE,
        cases=VERIFICATION,
        parts=len(BULK_PARTS),
        code=CODE.of_script("check_bulk_part"),
    message:
        "Simulate heaps and shear tests over many seeds, changing one setting at a time; part {wildcards.part}."
    script:
        "../scripts/check_bulk_part.py"


rule check_bulk:
    input:
        parts=expand("results/verification/bulk/{part}.parquet", part=BULK_PARTS),
    output:
        runs="results/verification/bulk_runs.parquet",
        table="results/verification/bulk.parquet",
    log:
        "logs/verification/bulk.log",
    params:
        cases=VERIFICATION,
        code=CODE.of_script("check_bulk"),
    message:
        "Compare the heaps and shear tests with each other and with published results."
    script:
        "../scripts/check_bulk.py"


rule verification_page:
    input:
        tables=expand("results/verification/{group}.parquet", group=[*GROUPS, "bulk"]),
        runs="results/verification/bulk_runs.parquet",
        peers=[path for path in PEERS if Path(path).exists()],
    output:
        page="docs/verification.md",
        figures=expand("docs/verification/{figure}.png", figure=FIGURES),
    log:
        "logs/verification/page.log",
    params:
        groups=[*GROUPS, "bulk"],
        cases=VERIFICATION,
        code=CODE.of_script("verification_page"),
    message:
        "Write the verification page with its figures."
    script:
        "../scripts/verification_page.py"
