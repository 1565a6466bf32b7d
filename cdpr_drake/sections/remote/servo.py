"""Places in a visual servo."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_rates import cable_rates_from_platform_twist
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.sections.remote.place import TWIST, Remote, servo_ports
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.systems.controllers.feature_servo import FeatureServo
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target


class RemoteServo(FeatureServo):
    """A `FeatureServo` whose velocities come from a process outside.

    Ports are those of `FeatureServo`, and tensions and lengths, vector(m) [N, m], in, which the
    process can see. Error and gain are those of the scenario's law, which goes on beside it; the
    process is asked at each update, also while the target is not found.

    In the place SERVO the process commands the winches and says which twist of the platform it
    wants by that, with which estimators reckon. In the place TWIST it commands the twist, and the
    winches follow by the believed robot's Jacobian, no faster than they can.
    """

    def __init__(
        self,
        controller: ServoController,
        target: Target,
        pinhole: Pinhole,
        rate: float,
        *,
        robot: Robot,
        place: str,
        X_CdO: RigidTransform,
    ) -> None:
        """Arguments as of `FeatureServo`, and place, robot and desired pose of the target."""
        super().__init__(controller, target, pinhole, rate)
        self._X_CdO, self._by_twist = pose_row(X_CdO), place == TWIST
        self._believed_rows = controller.robot.cables.packed()
        m = len(robot.cables)
        inputs, outputs = servo_ports(place, robot, (target.mark, target.size), controller.size)
        none = {"cable_velocities": np.zeros(m), "platform_velocity": np.zeros(6)}
        self.outside = Remote(place, inputs, outputs, none)
        for name in ("tensions", "lengths"):
            self.DeclareVectorInputPort(name, m)

    def decide(
        self, read: Callable[[str], Any], memory: Array, time: float
    ) -> tuple[dict[str, Array], Array]:
        """As `FeatureServo.decide`, with what the process commands."""
        outputs, memory = super().decide(read, memory, time)
        error = outputs.get("error", np.full(self.controller.size, np.nan))

        def see(name: str) -> Array:
            if name == "error":
                return error
            if name == "X_CO_desired":
                return self._X_CdO
            found = read(name)
            return pose_row(found) if isinstance(found, RigidTransform) else found

        given = self.outside.ask(time, see)
        twist = np.asarray(given["platform_velocity"])
        outputs["platform_velocity"] = twist
        if self._by_twist:
            outputs["cable_velocities"] = self._winches(twist, read("X_WP"), outputs)
        else:
            outputs["cable_velocities"] = np.asarray(given["cable_velocities"])
        return outputs, memory

    def _winches(self, twist: Array, X_WP: RigidTransform, outputs: dict[str, Array]) -> Array:
        """Cable velocities for a twist; both are scaled down where the winches are too slow."""
        rates = cable_rates_from_platform_twist(
            X_WP.rotation().matrix(), X_WP.translation(), self._believed_rows, twist
        )
        share = min(1.0, self.controller.robot.cable_speed / max(np.max(np.abs(rates)), 1e-300))
        outputs["platform_velocity"] = share * twist
        return share * rates
