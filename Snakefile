# virtual-soil: table of contents. The method's steps stand in workflow/rules, in reading order.
from snakemake.utils import min_version

min_version("9.0")


configfile: "config/config.yaml"


include: "workflow/rules/scheduling.smk"
include: "workflow/rules/common.smk"
include: "workflow/rules/measure.smk"
include: "workflow/rules/design.smk"
include: "workflow/rules/repose.smk"
include: "workflow/rules/shear.smk"
include: "workflow/rules/screening.smk"
include: "workflow/rules/surrogates.smk"
include: "workflow/rules/optimise.smk"
include: "workflow/rules/refine.smk"
include: "workflow/rules/verify.smk"
include: "workflow/rules/checks.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/export.smk"
include: "workflow/rules/manifest.smk"
include: "workflow/rules/pictures.smk"
include: "workflow/rules/first_answer.smk"
include: "workflow/rules/verification.smk"


rule all:
    default_target: True
    input:
        f"{RESULTS}/report.html",
        f"{RESULTS}/calibration.parquet",
        expand(f"{RESULTS}/export/{{case}}/material.json", case=CASES),
        f"{RESULTS}/manifest.sha256",
        # what only stands between two files that are there, Snakemake does not miss; these a damaged simulation takes with it
        expand(
            f"{RESULTS}{{stage}}/{{table}}.parquet",
            stage=["", *LATER_STAGES],
            table=["repose", "shear"],
        ),
