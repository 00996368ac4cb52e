# Is the soil of coarser, softer grains under the wheel still the calibrated one, and do the wheel's numbers depend on resolution and
# protocol? Not part of `all`. The base runs are jobs of wheel.smk.
wildcard_constraints:
    change="|".join(check_runs.CHANGES),
    test_seed=r"\d+",


localrules:
    wheel_tests_design,
    measure_wheel_tests,
    measure_check,
    check_report,


rule check_wheel_soil:
    input:
        f"{RESULTS}/wheel_check.html",


use rule prepare_bed as prepare_changed_bed with:
    input:
        kernels=WHEEL_KERNELS,
        preparation=preparation,
    output:
        bed=f"{CHANGED_BED}/bed.npz",
        row=f"{CHANGED_BED}/bed.parquet",
    log:
        f"{CHANGED_LOG}/bed.log",
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=changed_runtime,
        mem_mb=changed_memory,
    params:
        soil=calibrated_soil,
        grains=lambda wildcards: wheel_soil.grain_settings(changed(wildcards)),
        engine=WHEEL_ENGINE,
        bed=lambda wildcards: wheel_setups.bed_settings(changed(wildcards)),
        checkpoint=checkpoint_of("_{change}_bed.npz"),
        dem=ENGINE,
        code=CODE.of_script("prepare_bed"),
    message:
        "Drop and settle a bed of the soil of {wildcards.case} with a changed setting, {wildcards.change}, seed {wildcards.bed_seed}."


use rule lower_wheel as lower_changed_wheel with:
    input:
        bed=changed_bed,
        mesh=[] if WHEEL["mesh"]["file"] is None else WHEEL["mesh"]["file"],
    output:
        lowered=f"{CHANGED_BED}/lowered.npz",
    log:
        f"{CHANGED_LOG}/lowered.log",
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=changed_runtime,
        mem_mb=changed_memory,
    params:
        soil=calibrated_soil,
        grains=lambda wildcards: wheel_soil.grain_settings(changed(wildcards)),
        engine=WHEEL_ENGINE,
        wheel=lambda wildcards: wheel_setups.lowering_settings(changed(wildcards)),
        checkpoint=checkpoint_of("_{change}_lowered.npz"),
        dem=ENGINE,
        code=CODE.of_script("lower_wheel"),
    message:
        "Lower the wheel with a changed setting, {wildcards.change}, on a bed of {wildcards.case}, seed {wildcards.bed_seed}."


use rule drive_wheel as drive_changed_wheel with:
    input:
        bed=changed_bed,
        lowered=f"{CHANGED_BED}/lowered.npz",
        mesh=[] if WHEEL["mesh"]["file"] is None else WHEEL["mesh"]["file"],
    output:
        run=f"{CHANGED_BED}/slip_{{slip}}/run.parquet",
        history=f"{CHANGED_BED}/slip_{{slip}}/history.parquet",
        rim=f"{CHANGED_BED}/slip_{{slip}}/rim.parquet",
        rut=f"{CHANGED_BED}/slip_{{slip}}/rut.parquet",
        field=f"{CHANGED_BED}/slip_{{slip}}/field.parquet",
    log:
        f"{CHANGED_LOG}/slip_{{slip}}.log",
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=changed_runtime,
        mem_mb=changed_memory,
    params:
        soil=calibrated_soil,
        grains=lambda wildcards: wheel_soil.grain_settings(changed(wildcards)),
        engine=WHEEL_ENGINE,
        wheel=lambda wildcards: wheel_setups.wheel_settings(changed(wildcards)),
        checkpoint=checkpoint_of("_{change}_slip_{slip}.npz"),
        dem=ENGINE,
        code=CODE.of_script("drive_wheel"),
    message:
        "Drive the wheel with a changed setting, {wildcards.change}, over a bed of {wildcards.case}, seed {wildcards.bed_seed}."


rule wheel_tests_design:
    output:
        table=f"{REPEATED}_design.parquet",
    log:
        f"{LOGS}/wheel/{{case}}/check/tests/{{experiment}}_design.log",
    params:
        rows=repeated_rows,
        code=CODE.of_script("wheel_tests_design"),
    message:
        "List the {wildcards.experiment} tests of {wildcards.case} with the wheel's grains."
    script:
        "../scripts/wheel_tests_design.py"


# A folder of simulations has the name of a batch (`campaign.batches`).
rule simulate_wheel_tests:
    output:
        before=f"{REPEATED}/verification{{test_seed}}/before.parquet",
        after=f"{REPEATED}/verification{{test_seed}}/after.parquet",
        history=f"{REPEATED}/verification{{test_seed}}/history.parquet",
        run=f"{REPEATED}/verification{{test_seed}}/run.parquet",
        timing=f"{REPEATED}/verification{{test_seed}}/timing.json",
    log:
        f"{LOGS}/wheel/{{case}}/check/tests/{{experiment}}/{{test_seed}}.log",
    threads: 1
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=lambda wildcards, attempt: runtime_min(
            repeated_members(wildcards), attempt
        ),
        mem_mb=lambda wildcards, attempt: memory_mb(
            repeated_members(wildcards), attempt
        ),
    params:
        members=members_to_repeat,
        digest=lambda wildcards: digest(repeated_members(wildcards)),
        engine=ENGINE,
        checkpoints=f"{RESULTS}/checkpoints/wheel/{{case}}_{{experiment}}_{{test_seed}}",
        code=code_with("simulate", "simulate"),
    message:
        "Simulate the {wildcards.experiment} tests of {wildcards.case} with the wheel's grains, seed {wildcards.test_seed}."
    script:
        "../scripts/simulate.py"


rule measure_wheel_tests:
    input:
        design=f"{REPEATED}_design.parquet",
        runs=expand(
            f"{REPEATED}/verification{{test_seed}}/run.parquet",
            test_seed=WHEEL_CHECK["test_seeds"],
            allow_missing=True,
        ),
        results=lambda wildcards: expand(
            f"{REPEATED}/verification{{test_seed}}/{BY_NAME[wildcards.experiment].MEASURED_FROM}.parquet",
            test_seed=WHEEL_CHECK["test_seeds"],
            **dict(wildcards.items()),
        ),
        timings=expand(
            f"{REPEATED}/verification{{test_seed}}/timing.json",
            test_seed=WHEEL_CHECK["test_seeds"],
            allow_missing=True,
        ),
    output:
        table=f"{REPEATED}.parquet",
    log:
        f"{LOGS}/wheel/{{case}}/check/tests/measure_{{experiment}}.log",
    params:
        settings=lambda wildcards: settings_for(
            BY_NAME[wildcards.experiment], "MEASURED_BY"
        ),
        code=code_with("measure", "measure"),
    message:
        "Measure the responses of the {wildcards.experiment} tests of {wildcards.case} with the wheel's grains."
    script:
        "../scripts/measure.py"


rule measure_check:
    input:
        check_refused,
        **runs_to_check(),
        tests=[
            f"{REPEATED}.parquet".format(case=case, experiment=experiment)
            for case, experiment in REPEATED_TESTS
        ],
    output:
        table=f"{RESULTS}/wheel_check.parquet",
    log:
        f"{LOGS}/wheel/measure_check.log",
    params:
        changes={name: check_runs.said(WHEEL, name, WHEEL_CHECK) for name in CHANGES},
        tests=REPEATED_TESTS,
        grains=repeated_grains,
        stresses_pa=check_tests.stresses_pa(WHEEL, WHEEL_CHECK),
        references=references,
        settings={
            name: settings_for(BY_NAME[name], "REDUCED_BY")
            for name in dict(map(reversed, REPEATED_TESTS))
        },
        limits={key: WHEEL_CHECK[key] for key in WHEEL_CHECK if "limit" in key},
        code=CODE.of_script(
            "measure_check",
            *sorted({module_of(name, "measure") for _, name in REPEATED_TESTS}),
        ),
    message:
        "Compare the wheel with one changed setting at a time, and the calibration's own tests with the wheel's grains."
    script:
        "../scripts/measure_check.py"


rule check_report:
    input:
        table=f"{RESULTS}/wheel_check.parquet",
    output:
        page=f"{RESULTS}/wheel_check.md",
        html=f"{RESULTS}/wheel_check.html",
    log:
        f"{LOGS}/wheel/check_report.log",
    params:
        verdicts=verdicts,
        run=CHECK_RUN,
        code=CODE.of_script("check_report"),
    message:
        "Say which differences under the wheel are larger than their errors and than what matters."
    script:
        "../scripts/check_report.py"
