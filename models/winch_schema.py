"""The schema of the winches in a robot file."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.schema.declarations import In, Refusal, Scope, filled, settings

if TYPE_CHECKING:  # statics need no winches
    from cdpr_drake.winches.drum import Drum
    from cdpr_drake.winches.friction import FrictionLaw
    from cdpr_drake.winches.groups import WinchGroups
    from cdpr_drake.winches.motor import WinchLaw


@settings
class Friction:
    """Friction of motor, gear and drum, at the motor's shaft; servoing thesis (5.7)."""

    coulomb: Annotated[float, In("N m", ge=0.0), "Coulomb friction F_c."]
    static: Annotated[float, In("N m", ge=0.0), "Static friction F_s, at least F_c."]
    viscous: Annotated[float, In("N m s/rad", ge=0.0), "Viscous friction F_v."] = 0.0
    stribeck_speed: Annotated[
        float, In("rad/s", gt=0.0), "Speed w_s over which static fades to Coulomb friction."
    ]
    settling_time: Annotated[
        float,
        In("s", gt=0.0),
        "Time in which a motor settles once friction can hold it; steps up to twice this "
        "are stable.",
    ] = 0.001

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Static friction below Coulomb's."""
        if self.static < self.coulomb:
            yield "static", f"{self.static:g}", f"at least coulomb = {self.coulomb:g} [N m]"

    def law(self) -> "FrictionLaw":
        """The same for the pure functions."""
        from cdpr_drake.winches.friction import FrictionLaw

        return FrictionLaw(
            self.coulomb, self.static, self.viscous, self.stribeck_speed, self.settling_time
        )


@settings
class DrumLayers:
    """Cable wound in layers; without this section the drum's radius does not change."""

    turns: Annotated[float, In("-", ge=1.0), "Turns in a layer; the last one climbs to the next."]
    height: Annotated[
        float | None,
        In("m", ge=0.0),
        "Growth of the radius from layer to layer; null: the cable's diameter.",
    ] = None
    wound: Annotated[float, In("m", ge=0.0), "Line on the drum at the home pose."]


@settings
class WinchLoops:
    """The inner loops of the drives."""

    velocity_bandwidth: Annotated[float, In("rad/s", gt=0.0), "Bandwidth of the speed loop."] = (
        200.0
    )
    position_bandwidth: Annotated[
        float, In("1/s", gt=0.0), "Bandwidth of the position loop around it."
    ] = 20.0


@settings
class Winch:
    """The winches; one kind for all cables of a robot.

    Radius, gear and rated speed suffice for ideal winches; those with motors need `inertia`.
    """

    drum_radius: Annotated[float, In("m", gt=0.0), "Radius of the drum."]
    gear_ratio: Annotated[float, In("-", gt=0.0), "Motor turns per drum turn."]
    motor_speed_rpm: Annotated[float, In("1/min", gt=0.0), "Rated speed of the motor."]
    motor_torque: Annotated[
        float | None, In("N m", gt=0.0), "Rated torque of the motor; null where unpublished."
    ] = None
    inertia: Annotated[
        float | None,
        In("kg m^2", gt=0.0),
        "Moment of inertia of rotor, gear and drum, at the motor's shaft; null where unknown.",
    ] = None
    friction: Annotated[Friction | None, "Friction; null: none."] = None
    layers: Annotated[DrumLayers | None, "Layers of cable on the drum; null: one layer."] = None
    brake_torque: Annotated[
        float | None,
        In("N m", gt=0.0),
        "Torque that the holding brake holds at the motor's shaft; null: no brake.",
    ] = None
    loops: Annotated[WinchLoops, "Inner loops."] = filled(WinchLoops)

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
