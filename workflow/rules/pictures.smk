# Not part of `all`: moving pictures of both tests at the base point, and files for ParaView: the same films, and stored grains.

EXPERIMENTS = ["repose", "shear"]
# the moments of each experiment of which the grains are stored
MOMENTS = {"repose": ["filled", "grains"], "shear": ["grains_before", "grains_after"]}


wildcard_constraints:
    experiment="|".join(EXPERIMENTS),
    moment="|".join([moment for moments in MOMENTS.values() for moment in moments]),


rule animations:
    input:
        expand(f"{RESULTS}/animations/{{experiment}}.gif", experiment=EXPERIMENTS),


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
    message:
        "Simulate the base point's {wildcards.experiment} test once more and film it, as a GIF and for ParaView."
    script:
        "../scripts/animate.py"


rule paraview:
    input:
        [
            f"{RESULTS}/vtu/{experiment}/{base_simulation(config, DESIGN, experiment)['simulation_id']}/{moment}.vtu"
            for experiment in EXPERIMENTS
            for moment in MOMENTS[experiment]
        ],
        expand(f"{RESULTS}/animations/{{experiment}}.pvd", experiment=EXPERIMENTS),


rule grains_vtu:
    input:
        grains=lambda wildcards: file_of(
            wildcards.simulation, wildcards.experiment, f"{wildcards.moment}.parquet"
        ),
    output:
        vtu=f"{RESULTS}/vtu/{{experiment}}/{{simulation}}/{{moment}}.vtu",
    log:
        f"{LOGS}/vtu/{{experiment}}/{{simulation}}/{{moment}}.log",
    message:
        "Write {wildcards.moment} of simulation {wildcards.simulation} for ParaView."
    script:
        "../scripts/grains_vtu.py"
