# Shared by the rules of `check_wheel_soil`: what is changed, what is repeated, and where it is stored.
from virtual_soil.wheel import check_runs, check_tests

CHANGES = check_runs.changes_of(WHEEL, WHEEL_CHECK)
CHECK_SEEDS = WHEEL_CHECK["bed_seeds"]
CHECK_RUN = check_runs.run_name(WHEEL, WHEEL_CHECK)
CHECKED = f"{RESULTS}/wheel/{{case}}/check"
CHANGED_BED = f"{CHECKED}/{{change}}/{{bed_seed}}"
CHANGED_LOG = f"{LOGS}/wheel/{{case}}/check/{{change}}/{{bed_seed}}"
REPEATED = f"{CHECKED}/tests/{{experiment}}"
# Rules on changed beds and those that they inherit from.
INHERITED = {
    "prepare_changed_bed": "prepare_bed",
    "lower_changed_wheel": "lower_wheel",
    "drive_changed_wheel": "drive_wheel",
}
# Pairs of case and experiment of the repeated tests.
REPEATED_TESTS = [
    (case, experiment)
    for case in WHEEL_CASES
    for experiment in check_tests.tests_of(config, case)
]


def changed(wildcards):
    """Section `wheel` of a changed run."""
    return check_runs.changed_wheel(WHEEL, WHEEL_CHECK, wildcards.change)


def changed_work(wildcards, rulename):
    """Expected work of a job of a rule on changed beds."""
    return wheel_work(wildcards, INHERITED[rulename], changed(wildcards))


def changed_runtime(wildcards, attempt, rulename):
    """Resource function: as `wheel_runtime`, of a changed run."""
    return requested_min(changed_work(wildcards, rulename).expected_s, attempt)


def changed_memory(wildcards, attempt, rulename):
    """Resource function: as `wheel_memory`, of a changed run."""
    work = changed_work(wildcards, rulename)
    return wheel_cost.requested_mb(INHERITED[rulename], work, attempt)


def bed_under(change):
    """Pattern of the folder of the bed under a changed run: its own, or that of the base."""
    return CHANGED_BED if check_runs.CHANGES[change].own_bed else BED


def changed_bed(wildcards):
    """Input function: the bed under a changed run."""
    return f"{bed_under(wildcards.change)}/bed.npz".format(**dict(wildcards.items()))


def runs_to_check():
    """Files of all runs of the wheel by name: <change>_runs, <change>_histories, <change>_beds, and the same of the base."""
    found = {}
    for name in (check_runs.BASE, *CHANGES):
        base = name == check_runs.BASE
        runs, beds = (BED, BED) if base else (CHANGED_BED, bed_under(name))
        where = {"case": WHEEL_CASES, "bed_seed": CHECK_SEEDS, "change": [name]}
        for files, folder in (
            ("runs", f"{runs}/slip_{CHECK_RUN}/run"),
            ("histories", f"{runs}/slip_{CHECK_RUN}/history"),
            ("beds", f"{beds}/bed"),
        ):
            found[f"{name}_{files}"] = expand(f"{folder}.parquet", **where)
    return found


def check_refused(wildcards):
    """Input function without files: refuses runs and tests that cannot begin, before a bed is prepared."""
    in_words(check_runs.check_any, CHANGES, REPEATED_TESTS)
    for case in WHEEL_CASES:
        soil = in_words(wheel_soil.soil_of_case, config, ANSWER, case)
        in_words(check_runs.check_changes, WHEEL, WHEEL_CHECK, soil, WHEEL_ENGINE)
    for case, experiment in REPEATED_TESTS:
        in_words(check_tests.check_tests, repeated(case, experiment), INSIST)
    tell_check_cost()
    return []


@functools.cache
def repeated_at(case, experiment, changed_ns):
    """Study and design rows of an experiment on the wheel's grains; cached until the calibration's modification time changes."""
    return in_words(
        check_tests.tests,
        config,
        WHEEL,
        WHEEL_CHECK,
        WHEEL_ENGINE,
        ANSWER,
        case,
        experiment,
    )


def repeated(case, experiment):
    """Study and design rows of an experiment on the wheel's grains of a case."""
    answer = Path(ANSWER)
    changed_ns = answer.stat().st_mtime_ns if answer.is_file() else None
    return repeated_at(case, experiment, changed_ns)


def repeated_rows(wildcards):
    """Parameter function: design rows of an experiment on the wheel's grains."""
    return repeated(wildcards.case, wildcards.experiment)[1]


def repeated_members(wildcards):
    """Simulations of one seed."""
    job = repeated(wildcards.case, wildcards.experiment)
    return in_words(check_tests.members, job, int(wildcards.test_seed), INSIST)


def members_to_repeat(wildcards, input):
    """Parameter function: simulations of one seed. With the argument `input`, Snakemake records only their digest."""
    return repeated_members(wildcards)


def references(wildcards):
    """Parameter function: case -> what the calibration says of the repeated responses."""
    limits = config["verify"]["difference_of_consequence"]
    return {
        case: [
            in_words(
                check_tests.reference_of,
                f"{RESULTS}/verification.parquet",
                case,
                response,
                limits[response.column],
            )
            for response in check_tests.asked(config, case).values()
        ]
        for case in WHEEL_CASES
    }


def repeated_grains(wildcards):
    """Parameter function: case -> experiment -> grains in the calibration and with the wheel's, in words."""
    found = {case: {} for case in WHEEL_CASES}
    for case, experiment in REPEATED_TESTS:
        job = repeated(case, experiment)
        found[case][experiment] = check_tests.said(config, job, experiment)
    return found


def planned_to_check():
    """Rule, work and number of the jobs on beds: the base's, and those of every change."""
    n_cases, n_beds = len(WHEEL_CASES), len(WHEEL_CASES) * len(CHECK_SEEDS)
    found = planned(wheel_jobs(n_cases, n_beds, [CHECK_RUN], [], False))
    for change in CHANGES:
        own = n_beds if check_runs.CHANGES[change].own_bed else 0
        jobs = [
            ("prepare_bed", {}, own),
            ("lower_wheel", {}, n_beds),
            ("drive_wheel", {"slip": CHECK_RUN}, n_beds),
        ]
        found += planned(jobs, check_runs.changed_wheel(WHEEL, WHEEL_CHECK, change))
    return found


@functools.cache
def tell_check_cost():
    """Print once what the target is expected to take; the tests follow the calibration, without which it is refused."""
    tests = [
        expected_s(*member)
        for case, experiment in REPEATED_TESTS
        for seed in WHEEL_CHECK["test_seeds"]
        for member in check_tests.members(repeated(case, experiment), seed, INSIST)
    ]
    line = wheel_cost.summary("check_wheel_soil", planned_to_check(), tuple(tests))
    print(line, file=sys.stderr)
