"""Batches: which simulations share a job, and what the batch is called.

Long simulations are a batch of their own, called by their id. Short ones go into a binary tree over the bits of their ids, which
are hashes: a node is split while its simulations together are expected to take too long. The leaves are batches, called by their
stage and the bits that their simulations have in common (campaign-0110). A new simulation changes one batch at most, or splits it.
"""

import hashlib
import json
import math
import re

#: What a batch may be called (a regular expression without groups that capture).
NAME = r"[0-9a-f]{10}|(?:campaign|round\d+|verification)(?:-[01]+)?"
#: A node is split when it takes longer than so many times the target: halves of it then lie about the target too.
SPLIT_RATIO = math.sqrt(2.0)


def later_stages(rounds: int) -> list[str]:
    """The stages after the campaign, in their order."""
    return [*(f"/rounds/{k}" for k in range(1, rounds + 1)), "/verification"]


def label(stage: str) -> str:
    """What the batches of a stage begin with; a stage is its folder below results/<study>: '', /rounds/2, /verification."""
    return stage.lstrip("/").replace("rounds/", "round") or "campaign"


def stage_of(batch: str) -> str | None:
    """The stage of a batch, None of a batch that is called by its only simulation."""
    name = batch.partition("-")[0]
    if name == "campaign":
        return ""
    if name == "verification":
        return "/verification"
    return f"/rounds/{name[5:]}" if re.fullmatch(r"round\d+", name) else None


def bits(simulation: str) -> str:
    """The bits of a simulation's id, first digit first."""
    return f"{int(simulation, 16):0{4 * len(simulation)}b}"


def may_hold(batch: str, simulation: str) -> bool:
    """Whether a simulation belongs into a batch of this name, if it is planned in that stage at all."""
    return batch == simulation or (stage_of(batch) is not None and bits(simulation).startswith(batch.partition("-")[2]))


def batches(expected_s: dict[str, float], target_s: float, stage: str) -> dict[str, list[str]]:
    """Batch -> sorted ids of its simulations. expected_s : id -> seconds; target_s : what a batch should take, 0: all are alone."""
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
    """Hash of what a batch simulates, for Snakemake to tell whether it changed (16 hex digits)."""
    return hashlib.sha256(json.dumps(members, sort_keys=True).encode()).hexdigest()[:16]
