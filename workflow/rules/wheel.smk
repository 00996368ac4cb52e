# Not part of `all`: a wheel, plates and a cone on the soils that a study has calibrated. Beds are prepared once for all of them.


wildcard_constraints:
    bed_seed=r"\d+",
    slip=r"-?[\d.e-]+|free",
    diameter=r"[\d.e-]+",


localrules:
    measure_wheel,
    measure_plate,
    measure_cone,
    compare_measured,
    handbook_wheel,
    wheel_report,


rule wheel:
    input:
        cost_told("wheel"),
        f"{RESULTS}/wheel.html",


rule plate:
    input:
        cost_told("plate"),
        f"{RESULTS}/plate.parquet",


rule cone:
    input:
        cost_told("cone"),
        f"{RESULTS}/cone.parquet",


rule compile_wheel_kernels:
    output:
        marker=WHEEL_KERNELS,
    log:
        f"{LOGS}/wheel/compile_kernels.log",
    params:
        engine=ENGINE,
        settings=WHEEL_ENGINE | {"periodic": True},
        adhesion=adhesion_laws(config),
        clumps=config["shape"] is not None,
        turning=True,
        code=CODE.of_script("compile_kernels"),
    message:
        "Compile the engine's kernels of beds and tools once, before they are used."
    script:
        "../scripts/compile_kernels.py"


rule steer_density:
    input:
        nothing_refused,
        kernels=WHEEL_KERNELS,
    output:
        row=PREPARATION,
    log:
        f"{LOGS}/wheel/{{case}}/preparation.log",
    priority: 3
    threads: 1
    resources:
        runtime=wheel_runtime,
        mem_mb=wheel_memory,
    params:
        soil=calibrated_soil,
        grains=WHEEL_GRAINS,
        engine=WHEEL_ENGINE,
        bed=wheel_setups.bed_settings(WHEEL),
        bulk_density_kg_m3=WHEEL["bed"]["bulk_density_kg_m3"],
        seed=WHEEL["bed"]["seeds"][0],
        # one of many equivalent soils does not stop the others
        nearest=lambda wildcards: wheel_soil.MEMBER in wildcards.case,
        dem=ENGINE,
        code=CODE.of_script("steer_density"),
    message:
        "Find the friction of the preparation that gives beds of {wildcards.case} their bulk density."
    script:
        "../scripts/steer_density.py"


rule wheel_film:
    input:
        f"{WHEEL_FILM}/film.gif",
        f"{WHEEL_FILM}/film.pvd",


rule prepare_bed:
    input:
        nothing_refused,
        kernels=WHEEL_KERNELS,
        preparation=preparation,
    output:
        bed=f"{BED}/bed.npz",
        row=f"{BED}/bed.parquet",
    log:
        f"{BED_LOG}/bed.log",
    priority: 2
    threads: 1
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=wheel_runtime,
        mem_mb=wheel_memory,
    params:
        soil=calibrated_soil,
        grains=WHEEL_GRAINS,
        engine=WHEEL_ENGINE,
        bed=wheel_setups.bed_settings(WHEEL),
        checkpoint=checkpoint_of("_bed.npz"),
        dem=ENGINE,
        code=CODE.of_script("prepare_bed"),
    message:
        "Drop and settle a bed of the soil of {wildcards.case}, seed {wildcards.bed_seed}."
    script:
        "../scripts/prepare_bed.py"


rule lower_wheel:
    input:
        bed=f"{BED}/bed.npz",
        mesh=[] if WHEEL["mesh"]["file"] is None else WHEEL["mesh"]["file"],
    output:
        lowered=f"{BED}/lowered.npz",
    log:
        f"{BED_LOG}/lowered.log",
    priority: 2
    threads: 1
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=wheel_runtime,
        mem_mb=wheel_memory,
    params:
        soil=calibrated_soil,
        grains=WHEEL_GRAINS,
        engine=WHEEL_ENGINE,
        wheel=wheel_setups.lowering_settings(WHEEL),
        checkpoint=checkpoint_of("_lowered.npz"),
        dem=ENGINE,
        code=CODE.of_script("lower_wheel"),
    message:
        "Lower the wheel on bed {wildcards.bed_seed} of {wildcards.case}, once for all slips."
    script:
        "../scripts/lower_wheel.py"


rule drive_wheel:
    input:
        bed=f"{BED}/bed.npz",
        lowered=f"{BED}/lowered.npz",
        mesh=[] if WHEEL["mesh"]["file"] is None else WHEEL["mesh"]["file"],
    output:
        run=f"{BED}/slip_{{slip}}/run.parquet",
        history=f"{BED}/slip_{{slip}}/history.parquet",
        rim=f"{BED}/slip_{{slip}}/rim.parquet",
        rut=f"{BED}/slip_{{slip}}/rut.parquet",
        field=f"{BED}/slip_{{slip}}/field.parquet",
    log:
        f"{BED_LOG}/slip_{{slip}}.log",
    priority: 1
    threads: 1
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=wheel_runtime,
        mem_mb=wheel_memory,
    params:
        soil=calibrated_soil,
        grains=WHEEL_GRAINS,
        engine=WHEEL_ENGINE,
        wheel=wheel_setups.wheel_settings(WHEEL),
        checkpoint=checkpoint_of("_slip_{slip}.npz"),
        dem=ENGINE,
        code=CODE.of_script("drive_wheel"),
    message:
        "Drive the wheel over bed {wildcards.bed_seed} of {wildcards.case} at slip {wildcards.slip}."
    script:
        "../scripts/drive_wheel.py"


rule film_wheel:
    input:
        bed=f"{BED}/bed.npz",
        lowered=f"{BED}/lowered.npz",
        mesh=[] if WHEEL["mesh"]["file"] is None else WHEEL["mesh"]["file"],
    output:
        film=f"{BED}/slip_{{slip}}/film.gif",
        series=f"{BED}/slip_{{slip}}/film.pvd",
        surfaces=f"{BED}/slip_{{slip}}/film_wheel.pvd",
        moments=directory(f"{BED}/slip_{{slip}}/film"),
    log:
        f"{BED_LOG}/film_{{slip}}.log",
    threads: 1
    resources:
        runtime=wheel_runtime,
        mem_mb=wheel_memory,
    params:
        soil=calibrated_soil,
        grains=WHEEL_GRAINS,
        engine=WHEEL_ENGINE,
        wheel=wheel_setups.wheel_settings(WHEEL),
        dem=ENGINE,
        code=CODE.of_script("film_wheel"),
    message:
        "Repeat the wheel's travel over bed {wildcards.bed_seed} of {wildcards.case} at slip {wildcards.slip} and film it."
    script:
        "../scripts/film_wheel.py"


rule press_plate:
    input:
        bed=f"{BED}/bed.npz",
    output:
        run=f"{BED}/plate_{{diameter}}/run.parquet",
        history=f"{BED}/plate_{{diameter}}/history.parquet",
    log:
        f"{BED_LOG}/plate_{{diameter}}.log",
    priority: 1
    threads: 1
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=wheel_runtime,
        mem_mb=wheel_memory,
    params:
        soil=calibrated_soil,
        grains=WHEEL_GRAINS,
        engine=WHEEL_ENGINE,
        plate={key: PLATE[key] for key in ("depth_m", "speed_m_s", "static_friction")},
        checkpoint=checkpoint_of("_plate_{diameter}.npz"),
        dem=ENGINE,
        code=CODE.of_script("press_plate"),
    message:
        "Press a plate of {wildcards.diameter} m into bed {wildcards.bed_seed} of {wildcards.case}."
    script:
        "../scripts/press_plate.py"


rule push_cone:
    input:
        bed=f"{BED}/bed.npz",
    output:
        run=f"{BED}/cone/run.parquet",
        history=f"{BED}/cone/history.parquet",
    log:
        f"{BED_LOG}/cone.log",
    priority: 1
    threads: 1
    resources:
        checkpoint_interval_s=CHECKPOINT_INTERVAL_S,
        runtime=wheel_runtime,
        mem_mb=wheel_memory,
    params:
        soil=calibrated_soil,
        grains=WHEEL_GRAINS,
        engine=WHEEL_ENGINE,
        cone=CONE,
        checkpoint=checkpoint_of("_cone.npz"),
        dem=ENGINE,
        code=CODE.of_script("push_cone"),
    message:
        "Push the cone into bed {wildcards.bed_seed} of {wildcards.case}."
    script:
        "../scripts/push_cone.py"


rule measure_wheel:
    input:
        beds=expand(f"{BED}/bed.parquet", **ON_BEDS),
        runs=files_of(WHEEL_RUNS, "run"),
        histories=files_of(WHEEL_RUNS, "history"),
    output:
        table=f"{RESULTS}/wheel.parquet",
    log:
        f"{LOGS}/wheel/measure_wheel.log",
    params:
        code=CODE.of_script("measure_wheel"),
    message:
        "Measure drawbar pull, torque and sinkage over the steady stretch of every run of the wheel."
    script:
        "../scripts/measure_wheel.py"


rule measure_plate:
    input:
        beds=expand(f"{BED}/bed.parquet", **ON_BEDS),
        runs=files_of(PLATE_RUNS, "run"),
        histories=files_of(PLATE_RUNS, "history"),
    output:
        table=f"{RESULTS}/plate.parquet",
    log:
        f"{LOGS}/wheel/measure_plate.log",
    params:
        code=CODE.of_script("measure_plate"),
    message:
        "Measure pressures under the plates, their law p = k z^n, and Bekker's moduli."
    script:
        "../scripts/measure_plate.py"


rule measure_cone:
    input:
        beds=expand(f"{BED}/bed.parquet", **ON_BEDS),
        runs=files_of(CONE_RUNS, "run"),
        histories=files_of(CONE_RUNS, "history"),
    output:
        table=f"{RESULTS}/cone.parquet",
    log:
        f"{LOGS}/wheel/measure_cone.log",
    params:
        code=CODE.of_script("measure_cone"),
    message:
        "Measure the gradient of the cone's resistance."
    script:
        "../scripts/measure_cone.py"


rule compare_measured:
    input:
        files=measurements,
        wheel=f"{RESULTS}/wheel.parquet",
        plate_runs=files_of(PLATE_RUNS, "run"),
        plate_histories=files_of(PLATE_RUNS, "history"),
    output:
        table=f"{RESULTS}/wheel_measured.parquet",
    log:
        f"{LOGS}/wheel/compare_measured.log",
    params:
        wheel=WHEEL["measured"],
        plate=PLATE["measured"],
        gravity_m_s2=WHEEL_ENGINE["gravity_m_s2"],
        code=CODE.of_script("compare_measured"),
    message:
        "Compare wheel and plates with measurements, point by point."
    script:
        "../scripts/compare_measured.py"


rule handbook_wheel:
    input:
        files=measurements,
        tables=expand(
            f"{RESULTS}/{{tool}}.parquet",
            tool=[tool for tool in TOOLS if tool != "cone"],
        ),
    output:
        table=f"{RESULTS}/wheel_handbook.parquet",
    log:
        f"{LOGS}/wheel/handbook_wheel.log",
    params:
        handbook=WHEEL["handbook"],
        measured=PLATE["measured"]["file"],
        depth_m=PLATE["depth_m"],
        gravity_m_s2=WHEEL_ENGINE["gravity_m_s2"],
        code=CODE.of_script("handbook_wheel"),
    message:
        "Compute the handbook's rigid wheel from the law of a plate."
    script:
        "../scripts/handbook_wheel.py"


rule wheel_report:
    input:
        files=measurements,
        measured=f"{RESULTS}/wheel_measured.parquet" if IS_MEASURED else [],
        handbook=f"{RESULTS}/wheel_handbook.parquet" if HAS_HANDBOOK else [],
        tables=expand(f"{RESULTS}/{{tool}}.parquet", tool=TOOLS),
        wheel_runs=files_of(WHEEL_RUNS, "run"),
        wheel_histories=files_of(WHEEL_RUNS, "history"),
        rim=files_of(WHEEL_RUNS, "rim"),
        rut=files_of(WHEEL_RUNS, "rut"),
        field=files_of(WHEEL_RUNS, "field"),
        plate_runs=files_of(PLATE_RUNS, "run"),
        plate_histories=files_of(PLATE_RUNS, "history"),
        cone_runs=files_of(CONE_RUNS, "run"),
        cone_histories=files_of(CONE_RUNS, "history"),
    output:
        page=f"{RESULTS}/wheel.md",
        html=f"{RESULTS}/wheel.html",
        figures=expand(
            f"{RESULTS}/wheel/figures/{{figure}}.png",
            figure=[*TOOLS, "wheel_over_time", "rim", "rut", "field"],
        ),
    log:
        f"{LOGS}/wheel/wheel_report.log",
    params:
        verdicts=verdicts,
        soils=soils_under_tools,
        engine=WHEEL_ENGINE,
        asked_density_kg_m3=WHEEL["bed"]["bulk_density_kg_m3"],
        sources=[WHEEL["measured"]["source"], PLATE["measured"]["source"]],
        code=CODE.of_script("wheel_report"),
    message:
        "Write the page of wheel, plates and cone, whose first line says whether the soil's answer is confirmed."
    script:
        "../scripts/wheel_report.py"
