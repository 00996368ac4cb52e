"""The virtual tests of a campaign, one package each; `registry` is the only list of them.

An experiment is a package with the schemas of its tables and with modules that define the names in MODULES. `declared` defines its
settings, responses and cost; `simulate` runs it as a job; `measure` evaluates its results; `laboratory` reads laboratory tests, if
a soil file may contain them. All modules except `declared` are imported by name where they are needed, so that a change in one
module reruns only the rules that use it.
"""

#: Module of an experiment -> names that it must define.
MODULES = {
    "declared": (
        *(
            "NAME",
            "NOUNS",
            "BY_DEFAULT",
            "RESPONSES",
            "LOAD",
            "COMPARED",
            "REDUCED",
            "MEASURED_FROM",
            "MEASURED_BY",
            "REDUCED_BY",
            "LABORATORY",
            "PROPERTIES",
            "DENSITIES",
            "TURNING",
            "APPARATUS",
            "SEEDS",
            "SOUND",
            "Settings",
        ),
        *(
            "Fidelity",
            "CHECK",
            "REFERENCE",
            "loads",
            "check_loads",
            "floors",
            "strength",
            "as_printed",
            "canonical",
            "setup",
            "cost",
        ),
    ),
    "simulate": ("STAGES", "MOMENTS", "HISTORY", "run", "row_of"),
    "measure": ("measured", "reduce", "compared"),
    "laboratory": ("KEYS", "read"),
}


def module_of(experiment: str, part: str) -> str:
    """Full name of a module of an experiment."""
    return f"{__name__}.{experiment}.{part}"
