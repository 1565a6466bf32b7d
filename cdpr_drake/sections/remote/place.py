"""The place of a process outside in a loop: whom it asks, and which ports are exchanged.

A `Remote` stands in the place and asks its `Commander`; `tension_ports` and `servo_ports` say what
is exchanged in which place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ClientEndedError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.sections.remote.driver import Port
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE

Read = Callable[[str], Array]
"""What stands at an output, by its name."""


class Commander(Protocol):
    """Who gives commands; `sections.remote.Driver` does."""

    def exchange(self, now: float, read: Read) -> Mapping[str, Array]:
        """Commands at a time [s], by the names of the inputs."""

    def report(self) -> dict[str, Any]:
        """What was exchanged, for a summary."""


class Remote:
    """Asks whoever commands for what a block would decide.

    A run sets `commander` before it starts; without one, asking raises.
    """

    def __init__(
        self,
        place: str,
        inputs: Sequence[Port],
        outputs: Sequence[Port],
        resting: Mapping[str, Array],
    ) -> None:
        """A place without anybody.

        Args:
            place: Name of the place.
            inputs: What is commanded.
            outputs: What can be seen.
            resting: Commands while kernels are loaded, by the names of the inputs.
        """
        self.place, self.inputs, self.outputs = place, tuple(inputs), tuple(outputs)
        self.commander: Commander | None = None
        self._resting = {name: np.array(value, float) for name, value in resting.items()}
        self._rests = False

    @contextmanager
    def resting(self) -> Iterator[None]:
        """Nobody is asked inside the block; the platform rests."""
        self._rests = True
        try:
            yield
        finally:
            self._rests = False

    def ask(self, now: float, read: Read) -> Mapping[str, Array]:
        """Commands at a time [s], by the names of the inputs; `read` says what stands at outputs.

        Raises:
            ClientEndedError: Nobody is there, or not any more.
        """
        if self._rests:
            return self._resting
        if self.commander is None:
            raise ClientEndedError(f"nobody stands in the place {self.place}; see cdpr serve")
        return self.commander.exchange(now, read)

    def report(self) -> dict[str, Any]:
        """Place and what was exchanged, for a summary."""
        found = {} if self.commander is None else self.commander.report()
        return {"place": self.place, **found}


CONTROLLER, DISTRIBUTOR, TRAJECTORY = "controller", "distributor", "trajectory"
SERVO, TWIST = "servo", "twist"

TENSION_PLACES = (DISTRIBUTOR, CONTROLLER, TRAJECTORY)
"""Places in dynamic control by tensions; the first one is the usual one."""

SERVO_PLACES = (SERVO, TWIST)
"""Places in a visual servo."""

POSE, TWIST_UNIT, WRENCH = "-, m", "rad/s, m/s", "N m, N"


def tension_ports(place: str, robot: Robot) -> tuple[list[Port], list[Port]]:
    """What the client commands and what it can see, in a place of `TENSION_PLACES`."""
    m = len(robot.cables)
    motion = Port(
        "desired_motion", MOTION_SIZE, "-, m, rad/s, m/s, rad/s^2, m/s^2",
        "pose (qw, qx, qy, qz, x, y, z), V_WP and A_WP, rotation first, that the platform should "
        "have",
    )  # fmt: skip
    wrench = Port("desired_wrench", 6, WRENCH, "F_P_W about Po that the cables shall put on P")
    state = Port(
        "platform_state", 6 if robot.is_planar() else 13, "-, m, rad/s, m/s",
        "x, y, angle and their rates" if robot.is_planar() else "pose X_WP and velocity V_WP",
    )  # fmt: skip
    outputs = [
        Port("X_WP", 7, POSE, "pose of the platform"),
        state,
        Port("lengths", m, "m", "lengths of the cables"),
        Port("tensions", m, "N", "tensions that are commanded until now"),
    ]
    if place == TRAJECTORY:
        return [motion], outputs
    outputs.append(motion)
    if place == CONTROLLER:
        return [wrench], outputs
    return [Port("tensions", m, "N", "commanded tensions, not negative")], [*outputs, wrench]


def servo_ports(
    place: str, robot: Robot, mark: tuple[str, int], features: int
) -> tuple[list[Port], list[Port]]:
    """What the client commands and what it can see, in a place of `SERVO_PLACES`.

    Args:
        place: The place.
        robot: The robot.
        mark: Name and size of the target's marks in an image.
        features: Size of the features' error.
    """
    m = len(robot.cables)
    twist = Port(
        "platform_velocity", 6, TWIST_UNIT,
        "twist (w, v) of P in P that is asked for; estimators reckon with it",
    )  # fmt: skip
    outputs = [
        Port("found", 1, "-", "1 while the target is seen"),
        Port("X_CO", 7, POSE, "measured pose of the target in the camera"),
        Port("X_CO_desired", 7, POSE, "desired pose of the target in the camera"),
        Port(mark[0], mark[1], "px", "marks of the target in the image"),
        Port("error", features, "rad, m, -", "s - s*(t) of the scenario's features"),
        Port("X_WP", 7, POSE, "estimated pose of the platform"),
        Port("lengths", m, "m", "lengths of the cables"),
        Port("tensions", m, "N", "tensions of the cables"),
    ]
    if place == TWIST:
        return [twist], outputs
    velocities = Port("cable_velocities", m, "m/s", "to the winches, positive pays out")
    return [velocities, twist], outputs
