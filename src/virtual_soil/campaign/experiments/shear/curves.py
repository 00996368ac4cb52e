"""Shear curves of a laboratory: which readings are shearing, and the zero and the sign of the force.

A logger records more than the test: the load that is put on, pauses, the way back, the unloading. What counts is the first pass
forward: from the last reading before the displacement grows to its largest value. Machines that pull, and force gauges that do not
begin at zero, are recognised by what all tests of a file have in common, and said to be corrected.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

#: Displacement that is no shearing yet, over the largest; way back, over the largest, that ends a pass.
START, BACK = 5e-3, 2e-2
#: A force at the beginning below this fraction of the largest, or between others below this fraction of them, is zero.
ZERO = 0.01
#: First readings that agree within this factor, under loads that differ by more, are those of a gauge that was not set to zero.
ALIKE = 1.5
#: A single reading is a spike if it exceeds both neighbours by this fraction of the larger and they agree within the second.
SPIKE, NEIGHBOURS = 0.3, 0.1
#: Stresses closer than this fraction are one nominal stress.
NOMINAL = 0.02
#: Between two tests of one label the displacement falls from above the first fraction of its span to below the second.
AWAY, HOME = 0.2, 0.05


@dataclass(frozen=True)
class Curve:
    """A test's forward pass, (n,) each: displacement in m, shear force in N or stress in Pa, normal stress in Pa."""

    label: str
    displacement_m: np.ndarray
    shear: np.ndarray
    normal_stress_pa: np.ndarray


def told_apart(table: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """The table with a label for every test where several have one, and this in words.

    Laboratories number repeats anew under every load. Where the displacement begins again under another load, it is another test.
    table : columns test, displacement_m, normal_stress_pa, in the order of the file.
    """
    labels, n = table["test"].astype(str).copy(), 0
    for label, test in table.groupby("test", sort=False):
        x, p = test["displacement_m"].to_numpy(dtype=float), test["normal_stress_pa"].to_numpy(dtype=float)
        begins = beginnings(np.abs(x - x[0]), p)
        if begins.size:
            n += begins.size + 1
            number = np.searchsorted(begins, np.arange(len(x)), side="right")
            labels[test.index] = [f"{label} ({1e-3 * p[max(begins[k - 1], 0) if k else 0]:g} kPa)" for k in number]
    return table.assign(test=labels), [f"{n} tests with a label in common told apart by their loads"] if n else []


def beginnings(x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Places (k,) where another test begins, in displacements from the first reading and normal stresses, (n,) each."""
    span = np.ptp(x)
    home = (x[:-1] > AWAY * span) & (x[1:] < HOME * span) & (np.abs(np.diff(p)) > NOMINAL * np.abs(p[:-1]))
    begins = np.flatnonzero(home) + 1
    tests = np.split(x, begins)[1:]
    sheared = [np.ptp(test) > AWAY * span for test in tests]  # a logger's last reading is no test
    return begins[np.array(sheared, bool)]


def curves_of(table: pd.DataFrame, shear: str) -> tuple[list[Curve], list[str]]:
    """Forward passes of all tests, and what was corrected or left out, in words.

    table : columns test, displacement_m, normal_stress_pa and `shear`, force or stress, in the order of the file.
    """
    passes, n_left, n_spikes, n_zeros, n_passes = [], 0, 0, 0, 0
    for label, test in table.groupby("test", sort=False):
        x, y, p = (test[name].to_numpy(dtype=float) for name in ("displacement_m", shear, "normal_stress_pa"))
        x = forwards(x)
        first, last = forward_pass(x)
        n_left += len(x) - (last - first)
        n_passes += int(x[last:].size > 0 and x[last:].min() < x[last - 1] - BACK * np.ptp(x))
        x, y, p = (values[first:last] for values in (x, y, p))
        high, zero = spikes(y)
        whole = ~(high | zero)
        n_spikes, n_zeros = n_spikes + int(high.sum()), n_zeros + int(zero.sum())
        passes.append(Curve(str(label), x[whole], y[whole], p[whole]))
    passes, corrected = with_zero_and_sign(passes)
    remarks = [
        *corrected,
        *([f"{n_left} readings before or after the shearing left out"] if n_left else []),
        *([f"first pass forward of {n_passes} tests that go back"] if n_passes else []),
        *([f"{n_spikes} single readings far above their neighbours left out"] if n_spikes else []),
        *([f"{n_zeros} single zeros between readings left out"] if n_zeros else []),
    ]
    return passes, remarks


def forwards(x: np.ndarray) -> np.ndarray:
    """Displacement from its first reading, positive in the direction in which the test goes farthest."""
    way = x - x[0]
    return -way if -way.min() > way.max() else way


def forward_pass(x: np.ndarray) -> tuple[int, int]:
    """First and last reading (exclusive) of the first pass forward; all readings if the displacement does not grow."""
    span = float(x.max())
    if span <= 0.0:
        return 0, len(x)
    moving = np.flatnonzero(x > START * span)
    first = max(int(moving[0]) - 1, 0)
    highest = np.maximum.accumulate(x)
    back = np.flatnonzero((x < highest - BACK * span) & (np.arange(len(x)) > first))
    end = int(back[0]) if len(back) else len(x)
    last = first + int(np.argmax(x[first:end])) + 1
    return first, max(last, first + 2) if len(x) > first + 1 else len(x)


def spikes(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Masks (n,) of single readings far above both neighbours, and of single zeros, where the neighbours agree.

    No soil does that within one reading.
    """
    high, zero = np.zeros(len(y), bool), np.zeros(len(y), bool)
    if len(y) < 5:
        return high, zero
    before, here, after = y[:-2], np.abs(y[1:-1]), y[2:]
    larger = np.maximum(np.abs(before), np.abs(after))
    agree = np.abs(before - after) <= NEIGHBOURS * larger
    high[1:-1] = (here > (1.0 + SPIKE) * larger) & agree
    zero[1:-1] = (here < ZERO * larger) & agree
    return high, zero


def with_zero_and_sign(curves: list[Curve]) -> tuple[list[Curve], list[str]]:
    """The curves with the gauge's zero and sign corrected where all of them agree on it, and these corrections in words."""
    remarks = []
    offsets = np.array([curve.shear[0] for curve in curves])
    spans = np.array([np.abs(curve.shear - curve.shear[0]).max() for curve in curves])
    if is_zero_error(offsets, spans):
        curves = [Curve(c.label, c.displacement_m, c.shear - c.shear[0], c.normal_stress_pa) for c in curves]
        remarks.append("the force at the first reading taken as zero")
    largest = [curve.shear[np.argmax(np.abs(curve.shear))] for curve in curves]
    if all(value < 0.0 for value in largest):
        curves = [Curve(c.label, c.displacement_m, -c.shear, c.normal_stress_pa) for c in curves]
        remarks.append("forces are negative throughout: their sign reversed")
    return curves, remarks


def is_zero_error(offsets: np.ndarray, spans: np.ndarray) -> bool:
    """True if the first readings of all tests are alike and not zero, while the tests differ: the gauge was not set to zero.

    Curves that begin with the strength itself (no reading before the shearing) grow with their load, and keep their values.
    """
    if len(offsets) < 2 or not (np.abs(offsets) > ZERO * spans).any() or (spans <= 0.0).any():
        return False
    alike = (np.sign(offsets) == np.sign(offsets[0])).all() and np.abs(offsets).max() <= ALIKE * np.abs(offsets).min()
    return bool(alike and spans.max() > ALIKE * spans.min())


def nominal(stresses: np.ndarray) -> int:
    """Number of nominal stresses among measured ones (n,): those closer than NOMINAL are one."""
    ordered = np.sort(np.asarray(stresses, float))
    return 1 + int((np.diff(ordered) > NOMINAL * np.abs(ordered[1:])).sum())
