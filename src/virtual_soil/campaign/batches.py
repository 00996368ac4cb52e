"""Batches: groups of simulations that share a job, and the names of the batches.

A long simulation is a batch of its own, named by its id. Short simulations are sorted into a binary tree over the bits of their
ids, which are hashes. A node is split if its total expected time is too long. The leaves are the batches, named by their stage and
the common leading bits of their simulations (campaign-0110). A new simulation therefore changes or splits at most one batch.
"""

import hashlib
import json
import math
import re

#: Pattern of a batch's name (a regular expression without capturing groups).
NAME = r"[0-9a-f]{10}|(?:campaign|round\d+|verification\d*)(?:-[01]+)?"
#: Ratio of expected time to target time above which a node is split; with sqrt(2) its halves are also close to the target.
SPLIT_RATIO = math.sqrt(2.0)


def later_stages(rounds: int, more_seeds: int) -> list[str]:
    """Return the stages after the campaign, in order; more_seeds : rounds of further seeds of the verification."""
    return [*(f"/rounds/{k}" for k in range(1, rounds + 1)), *verification_stages(more_seeds)]


def verification_stages(more_seeds: int) -> list[str]:
    """Return the stages of the verification: with its first seeds, and with those of the rounds that are needed to decide."""
    return ["/verification", *(f"/verification/{k}" for k in range(1, more_seeds + 1))]


def parts_of(stage: str) -> tuple[str, str]:
    """Return kind (rounds, verification; empty for the campaign) and number of a stage (empty if it has none)."""
    kind, _, number = stage.lstrip("/").partition("/")
    return kind, number


def label(stage: str) -> str:
    """Prefix of a stage's batch names; a stage is given by its folder below results/<study>: '', /rounds/2, /verification/1."""
    kind, number = parts_of(stage)
    return f"{kind.replace('rounds', 'round')}{number}" or "campaign"


def stage_of(batch: str) -> str | None:
    """Stage of a batch; None for a batch named by its only simulation."""
    name = batch.partition("-")[0]
    if name == "campaign":
        return ""
    found = re.fullmatch(r"(round|verification)(\d*)", name)
    if found is None:
        return None
    kind, number = found.groups()
    return f"/rounds/{number}" if kind == "round" else f"/verification/{number}".rstrip("/")


def bits(simulation: str) -> str:
    """Bits of a simulation's id, most significant first."""
    return f"{int(simulation, 16):0{4 * len(simulation)}b}"


def may_hold(batch: str, simulation: str) -> bool:
    """True if a batch of this name may contain the simulation, provided that its stage plans it."""
    return batch == simulation or (stage_of(batch) is not None and bits(simulation).startswith(batch.partition("-")[2]))


def batches(expected_s: dict[str, float], target_s: float, stage: str) -> dict[str, list[str]]:
    """Return batch -> sorted ids of its simulations. expected_s : id -> seconds; target_s : seconds per batch, 0: one each."""
    short = sorted(name for name, seconds in expected_s.items() if seconds < target_s)
    found = {name: [name] for name in expected_s if expected_s[name] >= target_s}
    code = {name: bits(name) for name in short}
    nodes = [("", short)] if short else []
    while nodes:
        prefix, names = nodes.pop()
        if len(names) == 1:
            found[names[0]] = names
        elif sum(expected_s[name] for name in names) <= SPLIT_RATIO * target_s:
            found[f"{label(stage)}-{prefix}".rstrip("-")] = names
        else:
            halves = {bit: [name for name in names if code[name][len(prefix)] == bit] for bit in "01"}
            nodes += [(prefix + bit, half) for bit, half in halves.items() if half]
    return found


def digest(members: list) -> str:
    """Hash of a batch's simulations, by which Snakemake detects changes (16 hex digits)."""
    return hashlib.sha256(json.dumps(members, sort_keys=True).encode()).hexdigest()[:16]
