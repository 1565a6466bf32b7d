"""What may be unknown of a robot's dynamics: the vector of equations, and what users read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import IdentificationError, accepted_names
from cdpr_drake.identification.regressor import (
    MASS,
    MOMENT,
    SIZE,
    about_center,
    central_parameters,
    inertial_parameters,
)

MASS_GROUP, CENTER, MOMENTS = "mass", "center_of_mass", "inertia"
STIFFNESS, DAMPING, FRICTION, STATIC = "stiffness", "damping", "friction", "static_friction"
GROUPS = (MASS_GROUP, CENTER, MOMENTS, STIFFNESS, DAMPING, FRICTION, STATIC)
"""Kinds of parameters: mass, centre of mass and inertia about it of the platform, stiffness and
retardation time of every cable, Coulomb and viscous friction of every winch, and by how much its
static friction is above Coulomb's."""

PLATFORM = (MASS_GROUP, CENTER, MOMENTS)
CABLES = (STIFFNESS, DAMPING)
WINCHES = (FRICTION, STATIC)

COMPLIANCE, LAG, OFFSET, COULOMB, EXCESS, VISCOUS = range(6)
"""Of each cable in the vector: 1 / EA [1/N], T / EA [s/N], by how much the cable is longer than its
winch counts [m], Coulomb friction [N m], static friction above it [N m], viscous friction
[N m s/rad]."""

PER_CABLE = 6

AXES, SIX = "xyz", ("xx", "yy", "zz", "xy", "xz", "yz")

Form: TypeAlias = dict[int, float]
"""A linear form of the vector: factors by place, of a constant at -1."""


class Parameter(NamedTuple):
    """A free parameter as users read it.

    Attributes:
        name: Its name.
        words: The same in words.
        unit: Its unit.
        size: By how much it is usually unknown.
        ratio: One linear form of the vector over another; None: neither, a moment of inertia about
            the centre of mass.
    """

    name: str
    words: str
    unit: str
    size: float
    ratio: tuple[Form, Form] | None


@dataclass(frozen=True, kw_only=True, eq=False)
class DynamicModel:
    """What is believed, or was found, of a robot's dynamics.

    Attributes:
        names: Of the cables, m of them.
        mass: Of the platform [kg].
        center_of_mass: p_PPcm, shape (3,) [m].
        inertia: Moments (xx, yy, zz) and products (xy, xz, yz) about it in P, shape (6,) [kg m^2].
        stiffness: EA, shape (m,) [N].
        retardation: T, shape (m,) [s].
        coulomb: F_c of the winches, shape (m,) [N m].
        static: F_s, shape (m,) [N m].
        viscous: F_v, shape (m,) [N m s/rad].
        stribeck_speed: w_s over which static fades to Coulomb friction [rad/s].
        offset: By how much cables are longer than winches count, shape (m,) [m].
    """

    names: tuple[str, ...]
    mass: float
    center_of_mass: Array
    inertia: Array
    stiffness: Array
    retardation: Array
    coulomb: Array
    static: Array
    viscous: Array
    stribeck_speed: float
    offset: Array

    def vector(self) -> Array:
        """The vector, shape (10 + 6 m,): inertial parameters, then `PER_CABLE` for each cable."""
        cables = np.empty((len(self.names), PER_CABLE))
        cables[:, COMPLIANCE] = 1.0 / self.stiffness
        cables[:, LAG] = self.retardation / self.stiffness
        cables[:, OFFSET] = self.offset
        cables[:, COULOMB], cables[:, VISCOUS] = self.coulomb, self.viscous
        cables[:, EXCESS] = self.static - self.coulomb
        return np.concatenate([self.inertial(), cables.ravel()])

    def inertial(self) -> Array:
        """The ten inertial parameters."""
        return inertial_parameters(self.mass, self.center_of_mass, self.inertia)

    def moved(self, theta: Array) -> DynamicModel:
        """The model that has this vector."""
        mass, center, inertia = central_parameters(theta[:SIZE])
        cables = theta[SIZE:].reshape(-1, PER_CABLE)
        return replace(
            self, mass=float(mass), center_of_mass=center, inertia=inertia,
            stiffness=1.0 / cables[:, COMPLIANCE],
            retardation=cables[:, LAG] / cables[:, COMPLIANCE], offset=cables[:, OFFSET].copy(),
            coulomb=cables[:, COULOMB].copy(), static=cables[:, COULOMB] + cables[:, EXCESS],
            viscous=cables[:, VISCOUS].copy(),
        )  # fmt: skip


def column(cable: int, what: int) -> int:
    """Where a parameter of a cable stands in the vector."""
    return SIZE + PER_CABLE * cable + what


@dataclass(frozen=True, eq=False)
class Layout:
    """Which parameters are free, and what they are called.

    Attributes:
        model: As it is believed.
        unknown: Groups that are unknown.
        common: Groups that are one for all cables or winches.
        offsets: Whether the winches' offsets are free, as where stiffness is sought.
        size: Length scale of the platform [m].
    """

    model: DynamicModel
    unknown: tuple[str, ...]
    common: tuple[str, ...] = ()
    offsets: bool = False
    size: float = 0.1

    def __post_init__(self) -> None:
        """Checks the groups.

        Raises:
            IdentificationError: One is not known, or common ones cannot be.
        """
        for what, words in (("unknown", self.unknown), ("common", self.common)):
            for word in words:
                if word not in GROUPS:
                    raise IdentificationError(
                        f"{what}: found {word!r}; {accepted_names(word, GROUPS)}"
                    )
        for word in self.common:
            if word in PLATFORM:
                raise IdentificationError(
                    f"common: found {word}; {accepted_names(word, (*CABLES, *WINCHES))}"
                )
        own = STIFFNESS in self.unknown and STIFFNESS not in self.common
        if DAMPING in self.common and own and DAMPING in self.unknown:
            raise IdentificationError(
                "common: found damping with a stiffness for each cable; accepted: both or neither"
            )

    @property
    def typical(self) -> Array:
        """By how much each parameter is usually unknown, shape (10 + 6 m,)."""
        model = self.model
        m, L = model.mass, self.size
        cables = np.empty((len(model.names), PER_CABLE))
        cables[:, COMPLIANCE] = 1.0 / model.stiffness
        cables[:, LAG] = 1e-2 / model.stiffness
        cables[:, OFFSET] = 0.01
        cables[:, [COULOMB, EXCESS]] = 0.05
        cables[:, VISCOUS] = 1e-3
        return np.concatenate([[m], [m * L] * 3, [m * L * L] * 6, cables.ravel()])

    def constraints(self, theta: Array) -> tuple[Array, Array]:
        """E, e with E theta = e: what is known, at a vector where that is not linear.

        Where inertia is known and the centre of mass is not, the inertia about Po is that with
        the centre of mass of `theta`.
        """
        model, unknown, believed = self.model, self.unknown, self.model.vector()
        rows: list[tuple[Form, float]] = []
        if MASS_GROUP not in unknown:
            rows.append(({MASS: 1.0}, believed[MASS]))
        if CENTER not in unknown:
            rows += [({1 + j: 1.0, MASS: -c}, 0.0) for j, c in enumerate(model.center_of_mass)]
        if MOMENTS not in unknown:
            c = model.center_of_mass if CENTER not in unknown else theta[MOMENT] / theta[MASS]
            each = zip(about_center(1.0, c), model.inertia, strict=True)
            rows += [({4 + j: 1.0, MASS: -lever}, value) for j, (lever, value) in enumerate(each)]
        of = {STIFFNESS: (COMPLIANCE,), FRICTION: (COULOMB, VISCOUS), STATIC: (EXCESS,)}
        for i in range(len(model.names)):
            for group, members in of.items():
                for k, first in ((column(i, what), column(0, what)) for what in members):
                    if group not in unknown:
                        rows.append(({k: 1.0}, believed[k]))
                    elif group in self.common and i > 0:
                        rows.append(({k: 1.0, first: -1.0}, 0.0))
            lag, flexible = column(i, LAG), column(i, COMPLIANCE)
            if DAMPING not in unknown:
                rows.append(({lag: 1.0, flexible: -float(model.retardation[i])}, 0.0))
            elif DAMPING in self.common and i > 0:
                share = float(model.stiffness[0] / model.stiffness[i])
                rows.append(
                    ({lag: 1.0, column(0, LAG): -1.0 if STIFFNESS in unknown else -share}, 0.0)
                )
            if not self.offsets:
                rows.append(({column(i, OFFSET): 1.0}, believed[column(i, OFFSET)]))
        E, e = np.zeros((len(rows), len(theta))), np.zeros(len(rows))
        for r, (entries, value) in enumerate(rows):
            E[r, list(entries)] = list(entries.values())
            e[r] = value
        return E, e

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The free parameters."""
        model, L, m, one = self.model, self.size, self.model.mass, {-1: 1.0}
        free = []
        if MASS_GROUP in self.unknown:
            free.append(Parameter(MASS_GROUP, "mass", "kg", m, ({MASS: 1.0}, one)))
        if CENTER in self.unknown:
            for j, x in enumerate(AXES):
                ratio = {1 + j: 1.0}, {MASS: 1.0}
                free.append(Parameter(f"{CENTER}.{x}", f"centre of mass along {x}", "m", L, ratio))
        if MOMENTS in self.unknown:
            size = m * L * L
            free += [Parameter(f"{MOMENTS}.{x}", f"inertia {x}", "kg m^2", size, None) for x in SIX]
        for group, word, words, unit, typical, above, below in (
            (STIFFNESS, "stiffness", "stiffness", "N", None, (), COMPLIANCE),
            (DAMPING, "retardation_time", "retardation time", "s", 1e-2, (LAG,), COMPLIANCE),
            (None, "length_offset", "length offset", "m", 0.01, (OFFSET,), None),
            (FRICTION, "coulomb", "Coulomb friction", "N m", 0.05, (COULOMB,), None),
            (FRICTION, "viscous", "viscous friction", "N m s/rad", 1e-3, (VISCOUS,), None),
            (STATIC, "static", "static friction", "N m", 0.05, (COULOMB, EXCESS), None),
        ):
            if self.offsets if group is None else group in self.unknown:
                for i, owner in enumerate(["all"] if group in self.common else model.names):
                    size = float(model.stiffness[i]) if typical is None else typical
                    ratio = (
                        {column(i, k): 1.0 for k in above} or one,
                        one if below is None else {column(i, below): 1.0},
                    )
                    name, label = f"{owner}.{word}", f"{owner}'s {words}"
                    free.append(Parameter(name, label, unit, size, ratio))
        return tuple(free)

    def values(self, theta: Array) -> Array:
        """The free parameters at a vector, shape (f,)."""
        inertia = iter(central_parameters(theta[:SIZE])[2])

        def at(form: Form) -> float:
            return sum(factor * (theta[k] if k >= 0 else 1.0) for k, factor in form.items())

        ratios = [p.ratio for p in self.parameters]
        return np.array([next(inertia) if r is None else at(r[0]) / at(r[1]) for r in ratios])

    def jacobian(self, theta: Array, Z: Array) -> Array:
        """Of `values` by steps y along the columns of Z, by central differences."""
        J = np.empty((len(self.parameters), Z.shape[1]))
        for k in range(Z.shape[1]):
            step = 1e-5 * Z[:, k]
            J[:, k] = (self.values(theta + step) - self.values(theta - step)) / 2e-5
        return J


def offsets_needed(unknown: Sequence[str]) -> bool:
    """Whether cables' lengths are used at all."""
    return any(group in unknown for group in CABLES)
