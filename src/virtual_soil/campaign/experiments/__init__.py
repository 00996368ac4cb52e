"""The virtual tests of a campaign, a package each; `registry` is the only list of them.

An experiment is a package with the schemas of its tables and with modules that have the names in MODULES. `declared` gives its
settings, responses and cost; `simulate` runs it as a job; `measure` reads its results; `laboratory` reads the
laboratory's own tests, where a soil file may hold such. All but `declared` are imported by name where they are needed, so that a
change in one reruns only what it made.
"""

#: Module of an experiment -> names that it must have.
MODULES = {
    "declared": (
        *("NAME", "NOUNS", "RESPONSES", "LOAD", "COMPARED", "REDUCED", "MEASURED_FROM", "LABORATORY", "SEEDS", "Settings"),
        *("Fidelity", "CHECK", "REFERENCE", "loads", "check_loads", "canonical", "setup", "cost"),
    ),
    "simulate": ("STAGES", "MOMENTS", "HISTORY", "run", "row_of"),
    "measure": ("measured", "reduce", "compared"),
    "laboratory": ("KEYS", "read"),
}


def module_of(experiment: str, part: str) -> str:
    """Full name of a module of an experiment."""
    return f"{__name__}.{experiment}.{part}"
