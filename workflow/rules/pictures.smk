# Not part of `all`: films of every experiment at the base point as GIF and for ParaView, and stored grains for ParaView.
# Moments of every test at which the grains are stored.
MOMENTS = ["before", "after"]


wildcard_constraints:
    moment="|".join(MOMENTS),


rule animations:
    input:
        expand(f"{RESULTS}/animations/{{experiment}}.gif", experiment=TESTS),


rule animate:
    input:
        kernels=f"{RESULTS}/kernels.txt",
    output:
        film=f"{RESULTS}/animations/{{experiment}}.gif",
        series=f"{RESULTS}/animations/{{experiment}}.pvd",
        moments=directory(f"{RESULTS}/animations/{{experiment}}"),
    log:
        f"{LOGS}/animations/{{experiment}}.log",
    params:
        row=lambda wildcards: base_simulation(config, DESIGN, wildcards.experiment),
        settings=lambda wildcards: experiment_settings(
            config, base_simulation(config, DESIGN, wildcards.experiment)
        ),
        engine=ENGINE,
        code=CODE.of_script("animate", *DESCRIBED, *SIMULATED),
    message:
        "Repeat the {wildcards.experiment} test at the base point and record it as a GIF and for ParaView."
    script:
        "../scripts/animate.py"


rule paraview:
    input:
        [
            f"{RESULTS}/vtu/{experiment}/{base_simulation(config, DESIGN, experiment)['simulation_id']}/{moment}.vtu"
            for experiment in TESTS
            for moment in MOMENTS
        ],
        expand(f"{RESULTS}/animations/{{experiment}}.pvd", experiment=TESTS),


rule grains_vtu:
    input:
        grains=lambda wildcards: file_of(
            wildcards.simulation, wildcards.experiment, f"{wildcards.moment}.parquet"
        ),
    output:
        vtu=f"{RESULTS}/vtu/{{experiment}}/{{simulation}}/{{moment}}.vtu",
    log:
        f"{LOGS}/vtu/{{experiment}}/{{simulation}}/{{moment}}.log",
    params:
        code=CODE.of_script("grains_vtu"),
    message:
        "Write the grains of simulation {wildcards.simulation} ({wildcards.moment} the test) for ParaView."
    script:
        "../scripts/grains_vtu.py"
