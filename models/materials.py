"""Materials of cables: one for all of a robot, and what single cables have of their own.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from cdpr_drake.cables.cable_behaviour import CableBehaviour
from cdpr_drake.schema.fields import number, optional_section


@dataclass(kw_only=True)
class BehaviourSettings:
    """What cables and their sheaves do beside the elastic law; see `cables.cable_behaviour`."""

    stiffening: float = number(
        "Growth of the tangent stiffness per tension: E S (1 + g t).", "1/N", 0.0, at_least=0.0,
        at_most=1.0,
    )  # fmt: skip
    expansion: float = number(
        "Of unstrained lengths with temperature.", "1/K", 0.0, at_least=-1e-3, at_most=1e-3
    )
    warmer: float = number(
        "Temperature above that at which lengths are counted.", "K", 0.0, at_least=-200.0,
        at_most=200.0,
    )  # fmt: skip
    sheave_friction: float = number(
        "Friction of cables in the grooves of their pulleys, tension times exp(mu angle).", "-",
        0.0, at_least=0.0, at_most=2.0,
    )  # fmt: skip
    sliding_speed: float = number(
        "Speed at which a cable in motion slides in its groove: friction grows as tanh of the "
        "speed over this one.", "m/s", 1e-3, at_least=1e-6, at_most=1.0,
    )  # fmt: skip
    creep_stiffness: float = number(
        "Of the part that creeps away under load, over E S; only cables in motion show it.", "-",
        0.0, at_least=0.0, at_most=10.0,
    )  # fmt: skip
    creep_time: float = number("In which it creeps away.", "s", 1.0, at_least=1e-3, at_most=1e7)

    def behaviour(self) -> CableBehaviour:
        """These numbers as the laws take them."""
        return CableBehaviour(
            stiffening=self.stiffening, expansion=self.expansion, warmer=self.warmer,
            sheave_friction=self.sheave_friction, sliding_speed=self.sliding_speed,
            creep_stiffness=self.creep_stiffness, creep_time=self.creep_time,
        )  # fmt: skip


@dataclass(kw_only=True)
class CableMaterial:
    """What the cables are made of; a cable's own `material` goes before it, key by key."""

    youngs_modulus: float = number("Young's modulus.", "Pa", above=0.0)
    diameter: float = number("Diameter.", "m", above=0.0)
    linear_density: float = number("Mass per length.", "kg/m", above=0.0)
    retardation_time: float = number(
        "Time T of the viscous damping, tension = E S (strain + T strain rate).",
        "s",
        at_least=0.0,
        at_most=1.0,  # creep rather than damping; and steps would be nanoseconds
    )
    breaking_load: float | None = number(
        "Tension at which a cable breaks; null where unpublished.", "N", None, above=0.0
    )
    behaviour: BehaviourSettings | None = optional_section(
        "Stiffening, heat, creep and friction of sheaves, for straight cables; null: none."
    )

    def axial_stiffness(self) -> float:
        """E S of a round cable [N]."""
        return float(self.youngs_modulus * math.pi * self.diameter**2 / 4.0)


@dataclass(kw_only=True)
class OwnMaterial:
    """What one cable is made of where that differs from the section `cable` of its robot."""

    youngs_modulus: float | None = number("Young's modulus.", "Pa", None, above=0.0)
    diameter: float | None = number("Diameter.", "m", None, above=0.0)
    linear_density: float | None = number("Mass per length.", "kg/m", None, above=0.0)
    retardation_time: float | None = number(
        "Time T of the viscous damping.", "s", None, at_least=0.0, at_most=1.0
    )
    breaking_load: float | None = number("Tension at which the cable breaks.", "N", None, above=0.0)


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


_MOST = {
    "youngs_modulus": (1e13, "Pa"), "diameter": (1.0, "m"), "linear_density": (1e4, "kg/m"),
    "retardation_time": (1e3, "s"),
}  # fmt: skip
"""Largest values of a material that make sense."""


def check_materials(
    common: CableMaterial,
    own: Sequence[OwnMaterial | None],
    fail: Callable[[str, object, str], None],
) -> None:
    """Refuses values that no cable has, by `fail`: field, what was found, what is accepted."""
    given = {"cable": asdict(common)} | {
        f"cables[{index}].material": given_material(material) for index, material in enumerate(own)
    }
    for where, values in given.items():
        for key, (most, unit) in _MOST.items():
            if values.get(key, 0.0) > most:
                fail(f"{where}.{key}", f"{values[key]:g}", f"at most {most:g} [{unit}]")
