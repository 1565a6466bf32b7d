"""The schema of the winches in a robot file.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.schema.fields import number, optional_section, section

if TYPE_CHECKING:  # statics need no winches
    from cdpr_drake.winches.drum import Drum
    from cdpr_drake.winches.friction import FrictionLaw
    from cdpr_drake.winches.groups import WinchGroups
    from cdpr_drake.winches.motor import WinchLaw


@dataclass(kw_only=True)
class Friction:
    """Friction of motor, gear and drum, at the motor's shaft; servoing thesis (5.7)."""

    coulomb: float = number("Coulomb friction F_c.", "N m", at_least=0.0)
    static: float = number("Static friction F_s, at least F_c.", "N m", at_least=0.0)
    viscous: float = number("Viscous friction F_v.", "N m s/rad", 0.0, at_least=0.0)
    stribeck_speed: float = number(
        "Speed w_s over which static fades to Coulomb friction.", "rad/s", above=0.0
    )
    settling_time: float = number(
        "Time in which a motor settles once friction can hold it; steps up to twice this are "
        "stable.",
        "s",
        1e-3,
        above=0.0,
    )

    def law(self) -> "FrictionLaw":
        """The same for the pure functions."""
        from cdpr_drake.winches.friction import FrictionLaw

        return FrictionLaw(
            self.coulomb, self.static, self.viscous, self.stribeck_speed, self.settling_time
        )


@dataclass(kw_only=True)
class DrumLayers:
    """Cable wound in layers; without this section the drum's radius does not change."""

    turns: float = number("Turns in a layer; the last one climbs to the next.", "-", at_least=1.0)
    height: float | None = number(
        "Growth of the radius from layer to layer; null: the cable's diameter.",
        "m",
        None,
        at_least=0.0,
    )
    wound: float = number("Line on the drum at the home pose.", "m", at_least=0.0)


@dataclass(kw_only=True)
class WinchLoops:
    """The inner loops of the drives."""

    velocity_bandwidth: float = number("Of the speed loop.", "rad/s", 200.0, above=0.0)
    position_bandwidth: float = number("Of the position loop around it.", "1/s", 20.0, above=0.0)


@dataclass(kw_only=True)
class Winch:
    """The winches; one kind for all cables of a robot.

    Radius, gear and rated speed suffice for ideal winches; those with motors need `inertia`.
    """

    drum_radius: float = number("Radius of the drum.", "m", above=0.0)
    gear_ratio: float = number("Motor turns per drum turn.", "-", above=0.0)
    motor_speed_rpm: float = number("Rated speed of the motor.", "1/min", above=0.0)
    motor_torque: float | None = number(
        "Rated torque of the motor; null where unpublished.", "N m", None, above=0.0
    )
    inertia: float | None = number(
        "Moment of inertia of rotor, gear and drum, at the motor's shaft; null where unknown.",
        "kg m^2",
        None,
        above=0.0,
    )
    friction: Friction | None = optional_section("Friction; null: none.")
    layers: DrumLayers | None = optional_section("Layers of cable on the drum; null: one layer.")
    brake_torque: float | None = number(
        "What the holding brake holds at the motor's shaft; null: no brake.",
        "N m",
        None,
        above=0.0,
    )
    loops: WinchLoops = section("Inner loops.", WinchLoops, required=False)

    def rated_motor_speed(self) -> float:
        """Rated speed of the motor [rad/s]."""
        return self.motor_speed_rpm * 2.0 * np.pi / 60.0

    def rated_cable_speed(self) -> float:
        """Cable speed at the motor's rated speed [m/s]. Source: servoing thesis (1.21)."""
        return self.rated_motor_speed() / self.gear_ratio * self.drum_radius

    def drum(
        self,
        cable_diameter: float | Array,
        radii: Array | None = None,
        advantages: Array | None = None,
    ) -> "Drum":
        """The drum with its gear; the cable's centre line is half a diameter [m] outside.

        The diameter is one number, or one for each cable, shape (m,); then so are radius and
        height of layers. So are radii of drums that differ [m] and mechanical advantages: n parts
        of line side by side are one on a drum of an n-th of the radius, of layers of an n-th of
        the height, with an n-th of the length wound.

        Source: servoing thesis (1.1).
        """
        from cdpr_drake.winches.drum import Drum

        radius = (self.drum_radius if radii is None else radii) + cable_diameter / 2.0
        n = 1.0 if advantages is None else advantages
        if self.layers is None:
            return Drum(radius / n, self.gear_ratio)
        height = cable_diameter if self.layers.height is None else self.layers.height
        turns, wound = self.layers.turns, self.layers.wound
        return Drum(radius / n, self.gear_ratio, turns, height / n, wound / n)

    def law(
        self,
        cable_diameter: float | Array,
        groups: "WinchGroups | None" = None,
        radii: Array | None = None,
        advantages: Array | None = None,
    ) -> "WinchLaw | None":
        """The winch with its motor; None where the inertia is not known."""
        from cdpr_drake.winches.friction import FrictionLaw
        from cdpr_drake.winches.motor import WinchLaw

        if self.inertia is None:
            return None
        return WinchLaw(
            drum=self.drum(cable_diameter, radii, advantages),
            inertia=self.inertia,
            rated_speed=self.rated_motor_speed(),
            rated_torque=np.inf if self.motor_torque is None else self.motor_torque,
            friction=FrictionLaw() if self.friction is None else self.friction.law(),
            brake_torque=self.brake_torque or 0.0,
            velocity_bandwidth=self.loops.velocity_bandwidth,
            position_bandwidth=self.loops.position_bandwidth,
            groups=groups,
        )
