"""Scenario section `torque_control`: how a visual servo commands winches by torque."""

from typing import Annotated

import numpy as np

from cdpr_drake.control.torque_law import ServoWrench, TensionController
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import FASTEST, In, OneOf, settings
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.winches.friction import FrictionLaw

TORQUE = "torque"
"""Mode of winches that are commanded by torque."""

SLACK_SHARE, SMALLEST_SLACK = 0.4, 0.05
"""Share of the smallest wanted tension below which a cable counts as slack; at least this [N]."""


@settings
class TorqueControl:
    """From a visual servo's twist to motor torques; read with winches.mode torque only.

    Gains fit a platform of some kilograms whose cables, as mounted, give some kN/m; stiffer cables
    need a higher rate, or a smaller `proportional`.
    """

    rate: Annotated[
        float, In("Hz", gt=0.0, le=FASTEST), "Steps per second of both loops, from twist to torque."
    ] = 1000.0
    method: Annotated[
        str,
        OneOf(METHODS),
        "How tensions are distributed; where there are none, those answer of which the "
        "wrench is nearest.",
    ] = "quadratic_program"
    limits: Annotated[
        np.ndarray | None, In("N", 2, ge=0.0), "Smallest and largest tension; null: the robot's."
    ] = None
    margin: Annotated[
        float, In("N", ge=0.0), "By how much wanted tensions stay within the limits."
    ] = 0.0
    velocity_gain: Annotated[
        float, In("1/s", gt=0.0), "Rate at which a platform's wrong velocity fades, mu."
    ] = 20.0
    integral_gain: Annotated[
        float, In("1/s2", ge=0.0), "Gain of the integral of the wrong velocity, kappa."
    ] = 100.0
    proportional: Annotated[
        float, In("-", ge=0.0), "Pull per missing tension, K_P of the tension loop."
    ] = 4.0
    integral: Annotated[
        float,
        In("1/s", ge=0.0),
        "Share of a wrong winding speed's pull that is gathered per second, K_I of the "
        "tension loop.",
    ] = 20.0
    derivative: Annotated[
        float, In("N s/m", gt=0.0), "Pull per wrong winding speed, K_D of the tension loop."
    ] = 300.0
    tension_rate: Annotated[
        float,
        In("N/s", gt=0.0),
        "Largest rate of the wanted tensions; that of a cable which has just come taut "
        "begins where its winch goes on as before.",
    ] = 200.0
    winding_speed: Annotated[
        float,
        In("m/s", gt=0.0),
        "How fast a winch may go beside what the platform's motion asks for, and winds up"
        " a slack cable.",
    ] = 0.05
    slack_below: Annotated[
        float | None,
        In("N", ge=0.0),
        "Measured tension below which a cable counts as slack: nothing is asked of it "
        "until it pulls with twice that; null: 0.4 of the smallest wanted tension, at "
        "least 0.05 N.",
    ] = None
    friction_ratio: Annotated[
        float,
        In("-", ge=0.0),
        "Friction that is compensated per that of the robot's file; 0: none.",
    ] = 1.0
    fading_speed: Annotated[
        float, In("m/s", gt=0.0), "Cable speed below which the compensation of dry friction fades."
    ] = 0.001

    def slack_tension(self, smallest: float) -> float:
        """Tension below which a cable counts as slack, by the smallest wanted one [N]."""
        if self.slack_below is not None:
            return self.slack_below
        return max(SLACK_SHARE * smallest, SMALLEST_SLACK)

    def tension_controller(
        self, radius: float, friction: FrictionLaw, smallest: float
    ) -> TensionController:
        """The inner loop.

        Args:
            radius: r_w / R_g [m/rad].
            friction: Friction by the robot's file.
            smallest: Smallest wanted tension [N].
        """
        share = self.friction_ratio
        return TensionController(
            proportional=self.proportional,
            integral=self.integral,
            derivative=self.derivative,
            winding_speed=self.winding_speed,
            slack_below=self.slack_tension(smallest),
            tension_rate=self.tension_rate,
            radius=radius,
            friction=FrictionLaw(
                share * friction.coulomb, share * friction.static, share * friction.viscous,
                friction.stribeck_speed,
            ),
            fading_speed=self.fading_speed,
        )  # fmt: skip

    def servo_wrench(self, servo_rate: float) -> ServoWrench:
        """The outer loop behind a servo of that rate [Hz]."""
        return ServoWrench(mu=self.velocity_gain, kappa=self.integral_gain, period=1.0 / servo_rate)

    def wanted_limits(self, robot: Robot) -> tuple[float, float]:
        """Smallest and largest wanted tensions of a robot [N]."""
        limits = None
        if self.limits is not None:
            limits = (float(self.limits[0]), float(self.limits[1]))
        low, high = robot.tension_limits(limits)
        return low + self.margin, high - self.margin
