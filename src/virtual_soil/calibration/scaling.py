"""Surrogates of one campaign for other grains, gravities and lift speeds, by dimensional analysis.

Rigid grains without adhesion have no length, time or stress scale of their own. With a geometry that grows with the grains, the
angle of a heap depends on radius r, gravity g and lift speed v through one number, v / sqrt(g r), and not on the density. So grains
of radius r tested at (g, v) respond as those of the campaign, tested at (g0, v0), with the radius

    r0 = r (g / g0) (v0 / v)^2

Strengths in plane shear depend on none of these at one inertial number. Both were checked by simulation: docs/scaling.md, whose
standard errors `Response.scaling_error` adds to those of the surrogates. A lift slower than all of the campaign's is answered by
its slowest, with `Response.slow_error`, and counts as extrapolated; a faster one is refused.

Limits: restitution, Poisson's ratio and geometry in radii are the campaign's; adhesion has a scale and is not covered.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.optimise import RADIUS
from virtual_soil.calibration.response import Response, Responses
from virtual_soil.calibration.space import space_of

#: A lift number may lie this fraction beyond the simulated ones, for speeds are printed with four digits.
ROUNDING = 1e-3


def lift_number(lift_speed_m_s: float, gravity_m_s2: float, radius_m: float) -> float:
    """Speed of the tube over that of grains falling by about their radius, v / sqrt(g r)."""
    return lift_speed_m_s / math.sqrt(gravity_m_s2 * radius_m)


@dataclass(frozen=True)
class Scaled:
    """A surrogate of a campaign for grains whose radius is 1/ratio of the campaign's at the same lift number.

    radius_m : radius of the grains if it is no variable, else None. added : standard error of the scaling, in the response's unit.
    simulated : False if no test of the campaign was lifted as slowly.
    """

    model: Any
    ratio: float
    radius_m: float | None
    added: float
    simulated: bool

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Range of every variable."""
        low, high = self.model.ranges[RADIUS]
        return {**self.model.ranges, RADIUS: (low / self.ratio, high / self.ratio)}

    @property
    def cv_rmse(self) -> float:
        """Error at points left out of the fit, and that of the scaling."""
        return math.hypot(self.model.cv_rmse, self.added)

    def campaigns(self, values) -> dict:
        """Values of the campaign's variables, each of the shape of the given ones."""
        radius = values[RADIUS] if self.radius_m is None else self.radius_m
        shape = np.shape(next(iter(values.values())))
        return {**values, RADIUS: np.broadcast_to(self.ratio * np.asarray(radius, float), shape)}

    def predict(self, values) -> np.ndarray:
        """Response; values maps every variable to a number or to arrays of one shape."""
        return self.model.predict(self.campaigns(values))

    def predict_with_error(self, values) -> tuple[np.ndarray, np.ndarray]:
        """Response and its standard error, that of the scaling included."""
        mean, error = self.model.predict_with_error(self.campaigns(values))
        return mean, np.hypot(error, self.added)

    def surrounds(self, values) -> bool:
        """True if the campaign's points surround a point, for a surrogate that knows them."""
        return self.simulated and self.model.surrounds(self.campaigns(values))


@dataclass(frozen=True, kw_only=True)
class Scaling:
    """A test of one's own in terms of a campaign's; see `scaling_of`.

    test : density_kg_m3, gravity_m_s2, lift_speed_m_s, and radius_m if it is fixed. ratio : radius of the campaign's grains over
    that of the test's at the same lift number. slow : True if the campaign's largest grains stand for a smaller lift number.
    known : True if both are the same test.
    """

    test: dict[str, float]
    ratio: float
    slow: bool
    known: bool

    @property
    def radius_m(self) -> float | None:
        """Radius of the grains if it is fixed."""
        return self.test.get(RADIUS)

    @property
    def its_own(self) -> bool:
        """True if nothing differs from the campaign: its test, and a radius that is not fixed."""
        return self.known and self.radius_m is None

    @property
    def grains(self) -> dict[str, float]:
        """Density of the grains, and their radius if it is fixed."""
        return {name: self.test[name] for name in (RADIUS, "density_kg_m3") if name in self.test}

    def surrogates(self, models: Mapping[str, Any], responses: Responses) -> dict[str, Any]:
        """The campaign's surrogates of these responses for this test. responses : see `answered`."""
        if self.its_own:
            return {name: models[name] for name in responses}
        return {name: self.surrogate(models[name], response) for name, response in responses.items()}

    def surrogate(self, model: Any, response: Response) -> Scaled:
        """The campaign's surrogate of one response for this test."""
        simulated = not (self.slow and response.slow_error)
        return Scaled(model, self.ratio, self.radius_m, self.error(response), simulated)

    def error(self, response: Response) -> float:
        """Standard error that is added to a response that is `answered`, in its unit."""
        if self.known:
            return 0.0
        return math.hypot(cast(float, response.scaling_error), self.slow * response.slow_error)

    def answered(self, responses: Responses) -> dict[str, Response]:
        """The responses that the campaign knows for this test."""
        return {name: response for name, response in responses.items() if self.known or response.scaling_error is not None}

    def design(self, design: dict) -> dict:
        """The campaign's design with the radii of this test's grains; without them if the radius is fixed."""
        if self.its_own:
            return design
        part = "ranges" if "ranges" in design else "sweep"
        radii = [radius / self.ratio for radius in design[part][RADIUS]]
        if self.radius_m is None:
            return {**design, part: {**design[part], RADIUS: radii}}
        others = {name: values for name, values in design[part].items() if name != RADIUS}
        left = [name for name in design["variables"] if name != RADIUS]
        fixed = {**design.get("fixed", {}), RADIUS: self.radius_m}
        return {**design, part: others, "variables": left, "fixed": fixed}


def scaling_of(asked: Mapping[str, float], simulated: Mapping[str, float], design: dict) -> Scaling:
    """How a test of one's own follows from a campaign.

    Parameters
    ----------
    asked : some of radius_m (then it is fixed), density_kg_m3, gravity_m_s2, lift_speed_m_s; the others are the campaign's.
    simulated : density_kg_m3, gravity_m_s2, lift_speed_m_s of the campaign. design : its design.

    Raises
    ------
    CalibrationError : at a fixed radius the lift is faster, in its number, than all that were simulated; or the campaign has one
        radius only, so that another test cannot be answered.
    """
    if not asked:
        return Scaling(test=dict(simulated), ratio=1.0, slow=False, known=True)
    demand(
        RADIUS in design["variables"], "variables of the reference", design["variables"], f"{RADIUS} among them, for another test"
    )
    smallest, largest = space_of(design).ranges[RADIUS]
    test = {**simulated, **asked}
    gravity, lift = test["gravity_m_s2"], test["lift_speed_m_s"]
    ratio = gravity / simulated["gravity_m_s2"] * (simulated["lift_speed_m_s"] / lift) ** 2
    slow = False
    if RADIUS in test:
        radius, fastest = test[RADIUS], lift_number(simulated["lift_speed_m_s"], simulated["gravity_m_s2"], smallest)
        number = lift_number(lift, gravity, radius)
        demand(
            number <= fastest * (1.0 + ROUNDING),
            "lift speed / sqrt(gravity x radius)",
            f"{number:.4g}",
            f"up to {fastest:.4g}, as simulated: at radius_m = {radius:g} and gravity_m_s2 = {gravity:g} a lift_speed_m_s up to "
            f"{fastest * math.sqrt(gravity * radius):.4g}",
        )
        slow = ratio * radius > largest * (1.0 + ROUNDING)
        ratio = min(ratio, largest / radius)
    known = ratio == 1.0 and test["density_kg_m3"] == simulated["density_kg_m3"] and not slow
    return Scaling(test=test, ratio=ratio, slow=slow, known=known)
