# virtual-soil: table of contents. The steps of the method are in workflow/rules, included in reading order.
from snakemake.utils import min_version

min_version("9.0")


configfile: f"{workflow.basedir}/config/config.yaml"


include: "workflow/rules/scheduling.smk"
include: "workflow/rules/common.smk"
include: "workflow/rules/measure.smk"
include: "workflow/rules/design.smk"
include: "workflow/rules/experiments.smk"
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
include: "workflow/rules/wheel_common.smk"
include: "workflow/rules/wheel.smk"
include: "workflow/rules/wheel_spread.smk"
include: "workflow/rules/wheel_check_common.smk"
include: "workflow/rules/wheel_check.smk"
include: "workflow/rules/bulk.smk"


rule all:
    default_target: True
    input:
        f"{RESULTS}/report.html",
        f"{RESULTS}/calibration.parquet",
        expand(f"{RESULTS}/export/{{case}}/material.json", case=CASES),
        f"{RESULTS}/manifest.sha256",
        # Snakemake does not rebuild a missing intermediate file. Requesting these tables makes it rebuild them.
        expand(
            f"{RESULTS}{{stage}}/{{experiment}}.parquet",
            stage=["", *LATER_STAGES],
            experiment=TESTS,
        ),
