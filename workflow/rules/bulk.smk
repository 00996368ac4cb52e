# Not part of `all`: three bulk benchmarks beside LIGGGHTS on the same packings, and the page that lists them. Not part of a study.
from virtual_soil.bulk import cost as bulk_cost
from virtual_soil.bulk import variants as bulk_variants
from virtual_soil.bulk.packings import packing_file

BULK_VARIANTS = {
    case: variants
    for case, variants in bulk_variants.variants(BULK).items()
    if case in BULK["cases"]
}
# Case, code and variant of every run.
BULK_RUNS = [
    f"{case}/{code}/{variant}"
    for case, variants in BULK_VARIANTS.items()
    for variant in variants
    for code in bulk_variants.CODES
]
BULK_FIGURES = list(BULK_VARIANTS)


wildcard_constraints:
    packing=r"(penetration|drum)_\d+",
    orifice="(small|large)(_full)?",
    bulk_case="|".join(bulk_variants.CASES),
    code="|".join(bulk_variants.CODES),
    variant=r"\w+",


rule bulk:
    input:
        "docs/bulk-benchmarks.md",


rule bulk_packing:
    input:
        table=lambda wildcards: in_words(
            packing_file, CHECKOUT / BULK["packings"], wildcards.packing
        ),
    output:
        packing="results/bulk/packings/{packing}.parquet",
    log:
        "logs/bulk/{packing}.log",
    params:
        folder=BULK["packings"],
        code=CODE.of_script("bulk_packing"),
    message:
        "Check the published packing {wildcards.packing}."
    script:
        "../scripts/bulk_packing.py"


rule bulk_fill:
    output:
        packing="results/bulk/packings/silo_{orifice}.parquet",
    log:
        "logs/bulk/silo_{orifice}.log",
    resources:
        runtime=lambda wildcards, attempt: requested_min(
            simulated_s(*bulk_cost.of_filling(wildcards.orifice), clumps=False),
            attempt,
        ),
    params:
        engine=ENGINE,
        code=CODE.of_script("bulk_fill"),
    message:
        "Fill the silo with the {wildcards.orifice} orifice closed."
    script:
        "../scripts/bulk_fill.py"


rule bulk_run:
    input:
        packing=lambda wildcards: "results/bulk/packings/{}.parquet".format(
            bulk_variants.packing_name(wildcards.bulk_case, wildcards.variant)
        ),
    output:
        curve="results/bulk/{bulk_case}/{code}/{variant}.parquet",
        cost="results/bulk/{bulk_case}/{code}/{variant}_cost.parquet",
    log:
        "logs/bulk/{bulk_case}/{code}/{variant}.log",
    resources:
        runtime=lambda wildcards, attempt: requested_min(
            simulated_s(
                *bulk_cost.of_run(
                    wildcards.bulk_case, wildcards.code, wildcards.variant
                ),
                clumps=False,
            ),
            attempt,
        ),
    params:
        engine=ENGINE,
        code=lambda wildcards: CODE.of_script(
            "bulk_run", f"virtual_soil.bulk.{wildcards.bulk_case}"
        ),
    message:
        "Run the {wildcards.bulk_case} benchmark, {wildcards.variant}, in {wildcards.code}."
    script:
        "../scripts/bulk_run.py"


rule bulk_page:
    input:
        curves=[f"results/bulk/{run}.parquet" for run in BULK_RUNS],
        costs=[f"results/bulk/{run}_cost.parquet" for run in BULK_RUNS],
        fillings=[
            f"results/bulk/packings/silo_{orifice}.parquet"
            for orifice in BULK_VARIANTS.get("silo", ())
        ],
    output:
        page="docs/bulk-benchmarks.md",
        figures=expand("docs/images/bulk_{figure}.png", figure=BULK_FIGURES),
    log:
        "logs/bulk/page.log",
    params:
        code=CODE.of_script("bulk_page"),
    message:
        "Compare both codes on the bulk benchmarks and write the page with its figures."
    script:
        "../scripts/bulk_page.py"
