"""The contact model: the only list of laws, and the functions by which the rest of the engine calls them.

A law is a module in `dem.contact.laws`. To add one, write the module and enter it in NORMAL, TANGENTIAL or ROLLING. It names

    PARAMETERS     the NamedTuple of one contact's constants that kernels read
    PROPERTIES     fields of `Interaction` that it needs
    COLUMNS        its columns of the pair table, filled by column_values(material, other, interaction)
    CONSTANTS      its rows of constants in a block of contacts, filled by `write`, read by `read`
    HISTORY        what a contact remembers, one row each
    WORDS          description and equation for the material card
    reach(columns, R_star)  gap up to which it acts (0: contact only), from the values of its columns

and the functions of its role that stand below under `by_law`. A rolling law also names

    SEPARATE_SPINS  False for a brake, equal for both grains and at most enough to stop their spins: it needs `resistance` only;
                    True for a spring, with torques that differ: it needs `rolling_force` and `rolling_spring` too
"""

from collections.abc import Mapping
from types import ModuleType
from typing import NamedTuple

import numpy as np

from dem.contact.laws import capillary, hertz, jkr, mindlin, mindlin_liggghts, pull_off, rolling_a, rolling_c
from dem.jit import by_type
from dem.layout import GEOMETRY, Access

#: Value of a setting -> law, for each role. The settings `adhesion`, `tangential_model`, `rolling_model`, `damping_model` choose.
NORMAL: Mapping[str, ModuleType] = {"none": hertz, "constant": pull_off, "jkr": jkr, "capillary": capillary}
TANGENTIAL: Mapping[str, ModuleType] = {"edem": mindlin, "liggghts": mindlin_liggghts}
ROLLING: Mapping[str, ModuleType] = {"type_a": rolling_a, "type_c": rolling_c}

#: Value of the setting `damping_model` -> dashpot of the normal law.
DAMPING_MODELS = hertz.DAMPING_MODELS

LAWS = (*NORMAL.values(), *TANGENTIAL.values(), *ROLLING.values())

#: Stands in for zero in m, N and rad, so that no division is by zero; its square root and square are float32 numbers too.
TINY = 1e-18


#: Columns of the pair table before those of the laws: dashpot ratio, which normal and tangential dashpot share.
BETA, COMMON_COLUMNS = range(2)


class Equivalent(NamedTuple):
    """Effective radius (m) and mass (kg) of two grains, dashpot ratio, and the normal law's `scale` (m^(1/4)).

    Constants of springs and dashpots are for a deformation in units of scale^4.
    """

    R_star: float
    m_star: float
    beta: float
    scale: float


class Numbers(NamedTuple):
    """Time step and constants in the contact precision; a plain literal would promote to float64."""

    dt: float
    one: float
    zero: float
    tiny: float


class Laws(NamedTuple):
    """Input of the contact stage: a law for each role (their values are read per contact), and numbers.

    separate : None, or True if the rolling law gives the two grains different torques (SEPARATE_SPINS).
    """

    normal: tuple
    tangential: tuple
    rolling: tuple
    separate: bool | None
    numbers: Numbers


class Model(NamedTuple):
    """Laws and constants of all contacts.

    pair_table (ordered pairs of materials, columns of the laws); number of materials; time step in s, float64; variants of code;
    gap in m up to which contacts may act.
    """

    laws: Laws
    pair_table: np.ndarray
    n_materials: int
    step_s: float
    access: Access
    reach_m: float


class Touch(NamedTuple):
    """State of a contact as the rolling law sees it.

    Lever arm over the grain's radius (ax, ay, az) and its inverse square, tangential stiffness, normal force that is not negative,
    p_i.
    """

    ax: float
    ay: float
    az: float
    inv_arm2: float
    S_t: float
    pressing: float
    share: float


def by_law(name):
    """Function `name` of the law whose parameters are the first argument."""
    return by_type({law.PARAMETERS: getattr(law, name) for law in LAWS if hasattr(law, name)})


def number_by_law(name):
    """Length of the tuple `name` of the law whose parameters are the argument: a constant for the compiler."""

    def constant(length):
        return lambda law: length

    return by_type({law.PARAMETERS: constant(len(getattr(law, name))) for law in LAWS})


n_columns, n_constants, n_history = (number_by_law(name) for name in ("COLUMNS", "CONSTANTS", "HISTORY"))
read, scale, write = by_law("read"), by_law("scale"), by_law("write")
touches, remember, deformation = by_law("touches"), by_law("remember"), by_law("deformation")
normal_force, spring_force, attracted = by_law("normal_force"), by_law("spring_force"), by_law("attracted")
normal_energy, torn_energy = by_law("normal_energy"), by_law("torn_energy")
tangential_stiffness, tangential_damping = by_law("tangential_stiffness"), by_law("tangential_damping")
tangential_limit, tangential_energy = by_law("tangential_limit"), by_law("tangential_energy")
acting_damping, shrink = by_law("acting_damping"), by_law("shrink")
resistance, rolling_force, rolling_spring = by_law("resistance"), by_law("rolling_force"), by_law("rolling_spring")


class ContactModel:
    """The laws that a simulation uses, looked up by its settings, and the widths that follow from them."""

    def __init__(self, rolling_model: str, damping_model: str, adhesion: str, tangential_model: str):
        self.damping = DAMPING_MODELS[damping_model]
        self.rolling_model, self.adhesion, self.tangential_model = rolling_model, adhesion, tangential_model
        self.n_columns, n_constants, self.n_history = (
            sum(len(getattr(law, name)) for law in self.modules) for name in ("COLUMNS", "CONSTANTS", "HISTORY")
        )
        self.n_columns += COMMON_COLUMNS
        self.n_constants = GEOMETRY + n_constants
        self.separate_spins: bool = self.modules[2].SEPARATE_SPINS

    @property
    def modules(self) -> tuple[ModuleType, ...]:
        """The laws; looked up each time, because a module cannot be copied with its simulation."""
        return NORMAL[self.adhesion], TANGENTIAL[self.tangential_model], ROLLING[self.rolling_model]

    def row(self, a, b, interaction) -> np.ndarray:
        """Row of the pair table for two materials."""
        common = [self.damping.ratio(interaction.restitution)]
        return np.concatenate([common, *(law.column_values(a, b, interaction) for law in self.modules)])

    def reach_m(self, pair_table: np.ndarray, largest_radius_m: float) -> float:
        """Largest gap in m up to which a contact of grains of at most this radius acts."""
        known, column, farthest = pair_table[~np.isnan(pair_table[:, 0])], COMMON_COLUMNS, 0.0
        for law in self.modules:
            values = known[:, column : column + len(law.COLUMNS)]
            farthest = max([farthest, *(law.reach(row, largest_radius_m) for row in values)])
            column += len(law.COLUMNS)
        return farthest

    def laws(self, number: type, time_step_s: float) -> Laws:
        """Laws and numbers for the kernels, in the contact precision."""
        normal, tangential, rolling = (law.PARAMETERS(*(number(0.0) for _ in law.PARAMETERS._fields)) for law in self.modules)
        normal = normal._replace(least=number(self.damping.least_force_n))
        numbers = Numbers(*(number(value) for value in (time_step_s, 1.0, 0.0, TINY)))
        return Laws(normal, tangential, rolling, True if self.separate_spins else None, numbers)


def work_of_adhesion(adhesion: str, pull_off_n: float, R_star_m: float) -> float:
    """Work of adhesion in J/m2 with which a law gives a pair of this effective radius a pull-off force; 0 for "none"."""
    return NORMAL[adhesion].work_of_adhesion(pull_off_n, R_star_m)


def words(rolling_model: str, adhesion: str = "none", tangential_model: str = "edem") -> dict[str, dict[str, str]]:
    """Role -> description and equation of the law in use, for the material card."""
    tangential = {"type": tangential_model, **TANGENTIAL[tangential_model].WORDS}
    rolling = {"type": rolling_model, **ROLLING[rolling_model].WORDS}
    return {"normal": NORMAL[adhesion].WORDS, "tangential": tangential, "rolling": rolling}
