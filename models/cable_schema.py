"""The schema of cables: materials, pulleys at both ends, rails of exit points, tension bounds."""

import math
from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Annotated, Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.schema.declarations import (
    LONGEST,
    Direction,
    In,
    Name,
    Point,
    Refusal,
    Scope,
    Text,
    settings,
    values,
)


@settings
class BehaviourSettings:
    """Effects of cables and sheaves beyond the elastic law; see `cables.cable_behaviour`."""

    stiffening: Annotated[
        float,
        In("1/N", ge=0.0, le=1.0),
        "Growth of the tangent stiffness per tension: E S (1 + g t).",
    ] = 0.0
    expansion: Annotated[
        float, In("1/K", ge=-0.001, le=0.001), "Expansion of unstrained lengths with temperature."
    ] = 0.0
    warmer: Annotated[
        float, In("K", ge=-200.0, le=200.0), "Temperature above that at which lengths are counted."
    ] = 0.0
    sheave_friction: Annotated[
        float,
        In("-", ge=0.0, le=2.0),
        "Friction of cables in the grooves of their pulleys, tension times exp(mu angle).",
    ] = 0.0
    sliding_speed: Annotated[
        float,
        In("m/s", ge=1e-06, le=1.0),
        "Speed at which a cable in motion slides in its groove: friction grows as tanh of"
        " the speed over this one.",
    ] = 0.001
    creep_stiffness: Annotated[
        float,
        In("-", ge=0.0, le=10.0),
        "Stiffness of the spring that creeps under load, over E S; only cables in motion show it.",
    ] = 0.0
    creep_time: Annotated[float, In("s", ge=0.001, le=10000000.0), "Creep time constant."] = 1.0


@settings
class CableMaterial:
    """Material of the cables; a cable's own `material` overrides it, key by key."""

    youngs_modulus: Annotated[float, In("Pa", gt=0.0, le=1e13), "Young's modulus."]
    diameter: Annotated[float, In("m", gt=0.0, le=1.0), "Diameter."]
    linear_density: Annotated[float, In("kg/m", gt=0.0, le=1e4), "Mass per length."]
    retardation_time: Annotated[
        float,
        In("s", ge=0.0, le=1.0),
        "Time T of the viscous damping, tension = E S (strain + T strain rate).",
    ]
    breaking_load: Annotated[
        float | None, In("N", gt=0.0), "Tension at which a cable breaks; null where unpublished."
    ] = None
    behaviour: Annotated[
        BehaviourSettings | None,
        "Stiffening, heat, creep and friction of sheaves, for straight cables; null: none.",
    ] = None

    def axial_stiffness(self) -> float:
        """E S of a round cable [N]."""
        return float(self.youngs_modulus * math.pi * self.diameter**2 / 4.0)


@settings
class OwnMaterial:
    """Material of one cable where it differs from the section `cable` of its robot."""

    youngs_modulus: Annotated[float | None, In("Pa", gt=0.0, le=1e13), "Young's modulus."] = None
    diameter: Annotated[float | None, In("m", gt=0.0, le=1.0), "Diameter."] = None
    linear_density: Annotated[float | None, In("kg/m", gt=0.0, le=1e4), "Mass per length."] = None
    retardation_time: Annotated[
        float | None, In("s", ge=0.0, le=1.0), "Time T of the viscous damping."
    ] = None
    breaking_load: Annotated[
        float | None, In("N", gt=0.0), "Tension at which the cable breaks."
    ] = None


def given_material(own: OwnMaterial | None) -> dict[str, float]:
    """What a cable gives of its own, by key, in SI units."""
    if own is None:
        return {}
    values = {field.name: getattr(own, field.name) for field in fields(own)}
    return {key: float(value) for key, value in values.items() if value is not None}


def own_material(common: CableMaterial, own: OwnMaterial | None) -> CableMaterial:
    """The material of one cable: its own values, and the common one's where it gives none."""
    given: dict[str, Any] = {**given_material(own)}
    return replace(common, **given)


@settings
class Pulley:
    """The swivelling pulleys at the exit points."""

    radius: Annotated[float, In("m", ge=0.0, le=LONGEST), "Radius of the groove."]
    swivel_axis: Annotated[
        Direction,
        "Direction in W in which the cable arrives at the exit point from its winch, and "
        "about which the pulley swivels; of any length.",
    ] = values(0.0, 0.0, 1.0)
    arm: Annotated[
        float,
        In("m", ge=0.0),
        "Length of arms instead of pulleys, across the swivel axis about which they swivel: "
        "cables begin at their ends. Arms at the anchor points of a platform that does not turn "
        "are the same.",
    ] = 0.0


@settings
class PlatformPulley:
    """Swivelling pulleys at the anchor points, where the platform has them."""

    radius: Annotated[float, In("m", ge=0.0), "Radius of the groove."]
    swivel_axis: Annotated[
        Direction,
        "Direction in P in which the cable arrives at the anchor point from where it is "
        "fixed, and about which the pulley swivels; of any length.",
    ] = values(0.0, 0.0, 1.0)


@settings
class Rail:
    """A straight rail on which an exit point can be put; it stands still while the robot moves."""

    axis: Annotated[Direction, "Direction in W in which the coordinate grows; of any length."]
    lower: Annotated[float, In("m"), "Smallest coordinate."]
    upper: Annotated[float, In("m"), "Largest coordinate."]
    at: Annotated[float, In("m"), "Coordinate of the exit point, from `exit_point`."] = 0.0

    def shift(self) -> Array:
        """From `exit_point` to where the cable leaves, shape (3,) [m]."""
        return np.asarray(self.at * self.axis / np.linalg.norm(self.axis), float)

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A rail without length, and a coordinate beyond its ends."""
        if not self.lower < self.upper:
            yield "", f"lower {self.lower:g}, upper {self.upper:g}", "lower < upper"
        elif not self.lower <= self.at <= self.upper:
            yield "at", f"{self.at:g}", f"{self.lower:g} to {self.upper:g} [m]"


@settings
class Cable:
    """One cable: where it leaves the frame and where it holds the platform."""

    name: Annotated[Name, "Name, once in a robot."]
    exit_point: Annotated[Point, "Exit point A in W."]
    anchor_point: Annotated[Point, "Anchor point B in P."]
    swivel_axis: Annotated[
        Direction | None, "Swivel axis of its pulley; null: that of `pulley`."
    ] = None
    pulley_radius: Annotated[
        float | None, In("m", ge=0.0), "Radius of the groove of its pulley; null: that of `pulley`."
    ] = None
    rail: Annotated[Rail | None, "Rail on which its exit point can be put; null: it is fixed."] = (
        None
    )
    winch: Annotated[
        Text | None,
        "Name of its winch; cables with the same name share one. Null: a winch of its own.",
    ] = None
    anchor_swivel_axis: Annotated[
        Direction | None,
        "Swivel axis in P of its pulley at the platform; null: that of `platform_pulley`.",
    ] = None
    anchor_pulley_radius: Annotated[
        float | None,
        In("m", ge=0.0),
        "Radius of the groove of its pulley at the platform; null: that of "
        "`platform_pulley`, 0 without one.",
    ] = None
    material: Annotated[
        OwnMaterial | None,
        "Its material where that differs from `cable`; null: nothing differs.",
    ] = None
    drum_radius: Annotated[
        float | None, In("m", gt=0.0), "Radius of its drum; null: that of `winch`."
    ] = None
    mechanical_advantage: Annotated[
        float,
        In("-", ge=1.0),
        "Mechanical advantage of a block and tackle: parallel parts of line between exit and "
        "anchor point, so line on its drum over length of the cable. The material is that of all "
        "parts together; rated speeds are of cables with 1.",
    ] = 1.0

    def base_of(self, p_WA: Array) -> Array:
        """The `exit_point` with which the cable leaves the frame at p_WA, shape (3,) [m]."""
        return np.array(p_WA if self.rail is None else p_WA - self.rail.shift(), float)


@settings
class TensionBounds:
    """Tensions that the robot may hold."""

    lower: Annotated[float, In("N", ge=0.0), "Smallest tension."]
    upper: Annotated[float, In("N", gt=0.0, le=1e9), "Largest tension."]

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Bounds with nothing between."""
        if self.lower >= self.upper:
            yield "", f"lower {self.lower:g}, upper {self.upper:g}", "lower < upper"
