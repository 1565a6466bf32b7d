"""Materials of cables: one for all of a robot, and what single cables have of their own."""

import math
from dataclasses import fields, replace
from typing import Annotated, Any

from cdpr_drake.cables.cable_behaviour import CableBehaviour
from cdpr_drake.schema.declarations import In, settings


@settings
class BehaviourSettings:
    """What cables and their sheaves do beside the elastic law; see `cables.cable_behaviour`."""

    stiffening: Annotated[
        float,
        In("1/N", ge=0.0, le=1.0),
        "Growth of the tangent stiffness per tension: E S (1 + g t).",
    ] = 0.0
    expansion: Annotated[
        float, In("1/K", ge=-0.001, le=0.001), "Of unstrained lengths with temperature."
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
        "Of the part that creeps away under load, over E S; only cables in motion show it.",
    ] = 0.0
    creep_time: Annotated[float, In("s", ge=0.001, le=10000000.0), "In which it creeps away."] = 1.0

    def behaviour(self) -> CableBehaviour:
        """These numbers as the laws take them."""
        return CableBehaviour(
            stiffening=self.stiffening, expansion=self.expansion, warmer=self.warmer,
            sheave_friction=self.sheave_friction, sliding_speed=self.sliding_speed,
            creep_stiffness=self.creep_stiffness, creep_time=self.creep_time,
        )  # fmt: skip


@settings
class CableMaterial:
    """What the cables are made of; a cable's own `material` goes before it, key by key."""

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
    """What one cable is made of where that differs from the section `cable` of its robot."""

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
