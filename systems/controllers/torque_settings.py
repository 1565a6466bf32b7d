"""Scenario section `torque_control`: how a visual servo commands winches by torque.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

import numpy as np

from cdpr_drake.control.torque_law import ServoWrench, TensionController
from cdpr_drake.schema.fields import FASTEST, array, number, text
from cdpr_drake.tensions.methods import METHODS
from cdpr_drake.winches.friction import FrictionLaw

SLACK_SHARE, SMALLEST_SLACK = 0.4, 0.05
"""Share of the smallest wanted tension below which a cable counts as slack; at least this [N]."""


@dataclass(kw_only=True)
class TorqueControl:
    """From a visual servo's twist to motor torques; read with winches.mode torque only.

    Gains fit a platform of some kilograms whose cables, as mounted, give some kN/m; stiffer cables
    need a higher rate, or a smaller `proportional`.
    """

    rate: float = number(
        "Steps per second of both loops, from twist to torque.",
        "Hz",
        1000.0,
        above=0.0,
        at_most=FASTEST,
    )
    method: str = text(
        "How tensions are distributed; where there are none, those answer of which the wrench is "
        "nearest.",
        "quadratic_program",
        choices=METHODS,
    )
    limits: np.ndarray | None = array(
        "Smallest and largest tension; null: the robot's.", "N", (2,), None, at_least=0.0
    )
    margin: float = number(
        "By how much wanted tensions stay within the limits.", "N", 0.0, at_least=0.0
    )
    velocity_gain: float = number(
        "Rate at which a platform's wrong velocity fades, mu.", "1/s", 20.0, above=0.0
    )
    integral_gain: float = number(
        "Gain of the integral of the wrong velocity, kappa.", "1/s2", 100.0, at_least=0.0
    )
    proportional: float = number(
        "Pull per missing tension, K_P of the tension loop.", "-", 4.0, at_least=0.0
    )
    integral: float = number(
        "Share of a wrong winding speed's pull that is gathered per second, K_I of the tension "
        "loop.",
        "1/s",
        20.0,
        at_least=0.0,
    )
    derivative: float = number(
        "Pull per wrong winding speed, K_D of the tension loop.", "N s/m", 300.0, above=0.0
    )
    tension_rate: float = number(
        "Largest rate of the wanted tensions; that of a cable which has just come taut begins "
        "where its winch goes on as before.",
        "N/s",
        200.0,
        above=0.0,
    )
    winding_speed: float = number(
        "How fast a winch may go beside what the platform's motion asks for, and winds up a slack "
        "cable.",
        "m/s",
        0.05,
        above=0.0,
    )
    slack_below: float | None = number(
        "Measured tension below which a cable counts as slack: nothing is asked of it until it "
        "pulls with twice that; null: 0.4 of the smallest wanted tension, at least 0.05 N.",
        "N",
        None,
        at_least=0.0,
    )
    friction_ratio: float = number(
        "Friction that is compensated per that of the robot's file; 0: none.",
        "-",
        1.0,
        at_least=0.0,
    )
    fading_speed: float = number(
        "Cable speed below which the compensation of dry friction fades.", "m/s", 0.001, above=0.0
    )

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
