"""All constants of a robot's cables, as they are or as somebody believes them to be."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.pulley_kernel import (
    CABLE_SET_COLUMNS,
    LINEAR_WEIGHT,
    PULLEY_RADIUS,
    SWIVEL_AXIS,
)
from cdpr_drake.geometry.two_pulleys_kernel import ANCHOR_AXIS, ANCHOR_RADIUS

_VECTORS = ("p_WA", "p_PB", "swivel_axis", "anchor_swivel_axis")

_OF_ALL = ("down", "beyond")
"""What a set has once for all its cables."""

UNIT_TOLERANCE = 1e-9
"""How far a swivel axis may be from length 1."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CableSet:
    """The cables of one robot, in its order of cables.

    The simulated truth and the model of a controller or an estimator are both one of these; they
    may differ. `dataclasses.replace(cables, stiffness=...)` makes a changed copy, and checks it.

    Attributes:
        p_WA: Exit points, where a cable enters the groove of its pulley, shape (3, m) [m].
        p_PB: Anchor points in the platform frame, shape (3, m) [m].
        stiffness: Axial stiffness E S, shape (m,) [N].
        retardation: Retardation time T of the viscous damping, shape (m,) [s].
        pulley_radius: Radius of the groove; 0: no pulley, the cable leaves A, shape (m,) [m].
        linear_weight: Weight per unstrained length, along `down`, shape (m,) [N/m].
        swivel_axis: Unit vectors in W: the axis through A about which a pulley swivels, in the
            direction in which the cable arrives at A from its winch, shape (3, m).
        breaking_load: Tension at which a cable breaks; infinite: never, shape (m,) [N].
        anchor_pulley_radius: Radius of the groove of a pulley at the platform, where the anchor
            point is where the cable leaves the groove for its fixed end; 0: none, shape (m,) [m].
        anchor_swivel_axis: Unit vectors in the platform frame: the axis through B about which a
            pulley at the platform swivels, in the direction in which the cable arrives at B from
            where it is fixed, shape (3, m).
        arm: Length of an arm that swivels about `swivel_axis`, across it, in the place of a pulley:
            the cable begins at its end; 0: none, shape (m,) [m].
        down: Direction of gravity in W, a unit vector, shape (3,).
        beyond: Constants of what all cables do beside the elastic law, see
            `cables.cable_behaviour.behaving_cables`, shape (k,); empty: nothing.
    """

    p_WA: Array
    p_PB: Array
    stiffness: Array
    retardation: Array
    pulley_radius: Array
    linear_weight: Array
    swivel_axis: Array
    breaking_load: Array
    anchor_pulley_radius: Array
    anchor_swivel_axis: Array
    arm: Array = field(default_factory=lambda: np.zeros(0))
    down: Array = field(default_factory=lambda: np.array([0.0, 0.0, -1.0]))
    beyond: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        """Copies the arrays and checks them.

        Raises:
            CableModelError: A shape or number is not accepted; names the attribute and cable.
        """
        m = np.shape(self.p_WA)[-1] if np.ndim(self.p_WA) == 2 else 0
        for each in fields(self):
            value = np.array(getattr(self, each.name), dtype=float)
            if each.name == "arm" and value.size == 0:
                value = np.zeros(m)
            if each.name == "beyond":
                object.__setattr__(self, each.name, value)
                continue
            points = each.name in _VECTORS
            shape = (3, m) if points else (3,) if each.name == "down" else (m,)
            if m == 0 or value.shape != shape:
                wanted = "(3, m)" if points else "(3,)" if each.name == "down" else "(m,)"
                raise CableModelError(
                    f"{each.name}: found shape {value.shape}; accepted: {wanted} with m >= 1 cables"
                )
            object.__setattr__(self, each.name, value)
        if not self._is_accepted():
            self._refuse()

    def _is_accepted(self) -> bool:
        """Whether all numbers are: at once, since models are made by the thousand.

        It is a little stricter with unit vectors than `_refuse`, which then looks for itself.
        """
        axes = np.array([self.swivel_axis, self.anchor_swivel_axis])
        numbers = np.array([
            self.retardation, self.pulley_radius, self.linear_weight, self.anchor_pulley_radius,
            self.stiffness, self.arm,
        ])  # fmt: skip
        points = np.isfinite(self.p_WA).all() and np.isfinite(self.p_PB).all()
        positive = (self.stiffness > 0.0).all() and (self.breaking_load > 0.0).all()
        limits = np.isfinite(numbers).all() and (numbers >= 0.0).all()
        lengths = np.abs(np.sqrt(np.einsum("kim,kim->km", axes, axes)) - 1.0)  # NaN is refused
        down = abs(math.sqrt(float(self.down @ self.down)) - 1.0)
        unit = (lengths <= 0.5 * UNIT_TOLERANCE).all() and down <= 0.5 * UNIT_TOLERANCE
        both = ((self.arm > 0.0) & (self.pulley_radius + self.anchor_pulley_radius > 0.0)).any()
        return bool(points and positive and limits and unit and not both)

    def _refuse(self) -> None:
        """Raises what is wrong with the first number that is, by name and cable, if any is."""
        for name in _VECTORS:
            self._require(name, np.all(np.isfinite(getattr(self, name)), axis=0), "finite")
        for name in ("stiffness",):
            value = getattr(self, name)
            self._require(name, np.isfinite(value) & (value > 0.0), "a finite number > 0")
        for name in (
            "retardation",
            "pulley_radius",
            "linear_weight",
            "anchor_pulley_radius",
            "arm",
        ):
            value = getattr(self, name)
            self._require(name, np.isfinite(value) & (value >= 0.0), "a finite number >= 0")
        alone = self.pulley_radius + self.anchor_pulley_radius == 0.0
        self._require("arm", (self.arm == 0.0) | alone, "0 with pulleys")
        self._require("breaking_load", self.breaking_load > 0.0, "> 0")
        if not abs(np.linalg.norm(self.down) - 1.0) <= UNIT_TOLERANCE:
            raise CableModelError(f"down: found {self.down}; accepted: a unit vector")
        for name in ("swivel_axis", "anchor_swivel_axis"):
            length = np.linalg.norm(getattr(self, name), axis=0)
            self._require(name, np.abs(length - 1.0) <= UNIT_TOLERANCE, "a unit vector")

    def _require(self, name: str, good: npt.NDArray[np.bool_], accepted: str) -> None:
        if not np.all(good):
            i = int(np.argmin(good))
            found = getattr(self, name)[..., i]
            raise CableModelError(f"{name} of cable {i + 1}: found {found}; accepted: {accepted}")

    @staticmethod
    def make(
        p_WA: Array,
        p_PB: Array,
        stiffness: Array | float,
        *,
        retardation: Array | float = 0.0,
        pulley_radius: Array | float = 0.0,
        linear_weight: Array | float = 0.0,
        swivel_axis: Array | tuple[float, float, float] = (0.0, 0.0, 1.0),
        breaking_load: Array | float = np.inf,
        arm: Array | float = 0.0,
        down: Array | tuple[float, float, float] = (0.0, 0.0, -1.0),
    ) -> CableSet:
        """A set in which one number or one axis may stand for all cables, fixed to the platform.

        Raises:
            CableModelError: A shape or number is not accepted.
        """
        m = np.shape(p_WA)[1]

        def axes(given: Array | tuple[float, float, float]) -> Array:
            axis = np.asarray(given, float)
            return np.tile(axis[:, np.newaxis], (1, m)) if axis.ndim == 1 else axis

        def each(value: Array | float) -> Array:
            return np.full(m, float(value)) if np.ndim(value) == 0 else np.asarray(value, float)

        return CableSet(
            p_WA=p_WA, p_PB=p_PB, stiffness=each(stiffness), retardation=each(retardation),
            pulley_radius=each(pulley_radius), linear_weight=each(linear_weight),
            swivel_axis=axes(swivel_axis), breaking_load=each(breaking_load),
            anchor_pulley_radius=np.zeros(m), anchor_swivel_axis=axes((0.0, 0.0, 1.0)),
            arm=each(arm), down=np.asarray(down, float),
        )  # fmt: skip

    @property
    def count(self) -> int:
        """Number of cables m."""
        return int(self.p_WA.shape[1])

    def chosen(self, cables: npt.NDArray[np.generic]) -> Self:
        """Some of the cables, in the order asked for.

        Args:
            cables: Which, shape (m,) of bool, or their numbers from 0.

        Raises:
            CableModelError: None is left.
        """
        parts = {
            each.name: getattr(self, each.name)[..., cables]
            for each in fields(self)
            if each.name not in _OF_ALL
        }
        return replace(self, **parts)

    def over_platform_pulleys(self, radius: Array | float, swivel_axis: Array) -> Self:
        """The same cables over pulleys at the platform.

        Args:
            radius: Of their grooves, shape (m,) or one for all [m].
            swivel_axis: Unit vectors in the platform frame, shape (3, m).

        Raises:
            CableModelError: A shape or number is not accepted.
        """
        radii = np.full(self.count, radius) if np.ndim(radius) == 0 else np.asarray(radius, float)
        axes = np.asarray(swivel_axis, float)
        return replace(self, anchor_pulley_radius=radii, anchor_swivel_axis=axes)

    def without_pulleys(self) -> Self:
        """The same cables from fixed exit points A to fixed anchor points B, also without arms."""
        none = np.zeros(self.count)
        return replace(self, pulley_radius=none, anchor_pulley_radius=none, arm=none)

    def has_pulleys(self) -> bool:
        """Whether any cable runs over a pulley of its own radius, at either end, or has an arm."""
        return self.has_platform_pulleys() or bool(np.any(self.pulley_radius + self.arm > 0.0))

    def has_platform_pulleys(self) -> bool:
        """Whether any cable runs over a pulley at the platform."""
        return bool(np.any(self.anchor_pulley_radius > 0.0))

    def geometry_words(self, pulleys: bool = True) -> str:
        """Geometry of these cables in words, as every result names it.

        Args:
            pulleys: False if the result was computed with `without_pulleys`.

        Returns:
            Such as "with pulleys of 20 mm"; "pulleys ignored"; or "no pulleys in the robot".
        """
        words = []
        for radii, where in (
            (self.pulley_radius, ""), (self.anchor_pulley_radius, " at the platform")
        ):  # fmt: skip
            over = radii[radii > 0.0]
            if len(over):
                least, largest = (f"{1e3 * radius:.4g}" for radius in (np.min(over), np.max(over)))
                size = least if least == largest else f"{least} to {largest}"
                some = "" if len(over) == self.count else f" on {len(over)} of {self.count} cables"
                words.append(f"pulleys of {size} mm{where}{some}")
        if not words:
            return "no pulleys in the robot"
        return f"with {' and '.join(words)}" if pulleys else "pulleys ignored"

    def packed(self) -> Array:
        """One contiguous array for the kernels, shape (m, 17 + k).

        Columns: exit point (3), anchor point (3), E S [N], T [s], radius of the groove, of an arm
        minus its length [m], weight
        per length [N/m], swivel axis (3), and of a pulley at the platform radius [m] and axis in P
        (3). Kernels of straight cables take the first eight, or
        these rows, and see cables without pulleys. Behind them stands `beyond`, k = 0 of elastic
        cables.
        """
        rows = np.empty((self.count, CABLE_SET_COLUMNS + len(self.beyond)))
        rows[:, 0:3], rows[:, 3:6] = self.p_WA.T, self.p_PB.T
        rows[:, 6], rows[:, 7] = self.stiffness, self.retardation
        rows[:, PULLEY_RADIUS] = self.pulley_radius - self.arm
        rows[:, LINEAR_WEIGHT] = self.linear_weight
        rows[:, SWIVEL_AXIS : SWIVEL_AXIS + 3] = self.swivel_axis.T
        rows[:, ANCHOR_RADIUS] = self.anchor_pulley_radius
        rows[:, ANCHOR_AXIS : ANCHOR_AXIS + 3] = self.anchor_swivel_axis.T
        rows[:, CABLE_SET_COLUMNS:] = self.beyond
        return rows
