"""Dynamic control with a process outside in the loop, in compiled steps without a diagram."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.commanded_tension_kernel import cable_motions
from cdpr_drake.control.task_space import tracking_wrench_at
from cdpr_drake.dynamics.advance_events_kernel import robot_addresses
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.dynamics.tracking_kernel import (
    ACTS,
    ENDS,
    LAST_REQUEST_MET,
    LOGS,
    REQUESTS_NOT_MET,
    ROWS,
    STEPS,
    TIME,
    due,
    start_tracking,
    track_on,
)
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_error, pose_from_row
from cdpr_drake.models.robot_in_plant import pose_from_state
from cdpr_drake.numerics.kernel_calls import array_addresses
from cdpr_drake.sections.remote.place import TRAJECTORY
from cdpr_drake.sections.remote.tensions import RemoteDistributor, RemoteTracking
from cdpr_drake.systems.diagrams.tension_control import TensionControl
from cdpr_drake.systems.diagrams.tension_loop import TensionRows
from cdpr_drake.systems.robots.compiled_step import PackedRule, motion_problem
from cdpr_drake.tensions.control_step_kernel import update_tensions_at
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE

NEVER = -1.0
"""A time before all others [s]."""


class RemoteTensionLoop(TensionRows):
    """What a `TensionControl` with a remote place and compiled steps does, without its diagram.

    As `TensionLoop`, which is one compiled call from report to report, but a call from instant to
    instant, with the process outside in between. State, tensions and log are the diagram's to the
    last bits; it asks at the same times. Two counters in the compiled call keep its time: a `Clock`
    as that of `ServoLoop` gives the same bits, but took 16 % more time without client's messages.
    """

    name = "remote"

    def __init__(self, control: TensionControl, log_rate: float) -> None:
        """At the beginning of the trajectory, at rest.

        Args:
            control: The blocks; not changed but for their work space.
            log_rate: Rows of the log per second [Hz].

        Raises:
            CdprError: A plant moves the robot, or there is no remote place.
        """
        motion, remote = control.motion, control.outside
        if motion is None or remote is None:
            raise CdprError(
                f"remote loop of {control.robot.name}: found a plant or no remote place; accepted: "
                "the engine compiled with a place"
            )
        blocks = control.blocks
        tracking, distributor = blocks.controller, blocks.distributor
        self._tracking = tracking if isinstance(tracking, RemoteTracking) else None
        self._distributor = distributor if isinstance(distributor, RemoteDistributor) else None
        self._law, self._distribution = tracking.packed(), distributor.packed()
        own = self._tracking is None
        self._own_law = self._law.table if own else self._law.table[:0]
        self._motion, self._rule = motion, PackedRule(motion.rule)
        self._robot = robot_addresses(motion.arrays())
        self._periods = np.array([1.0 / distributor.rate, 1.0 / log_rate])
        start = motion.state(motion.GetMyContextFromRoot(control.make_context()))
        self._memory = start_tracking(start, self._distribution.bounds[0])
        self._at = array_addresses(self._memory)
        if own:
            tracking_wrench_at(self._law.table, 0.0, self._memory.state, self._memory.wrench)
        self._height = float(control.robot.plane_height or 0.0)
        self._cables = control.cables.packed()
        self._goal, self._asked_at = np.zeros(MOTION_SIZE), NEVER
        super().__init__(control, len(start))
        if remote.place == TRAJECTORY:
            self.sizes["desired_motion"] = MOTION_SIZE

    @property
    def time(self) -> float:
        """Time that is reached [s]."""
        return float(self._memory.clock[TIME])

    def advance_to(self, until: float) -> None:
        """Goes on to a time [s].

        Raises:
            ClientEndedError: The process outside is gone, silent, or makes no sense.
            CableGeometryError: A cable cannot run.
            DivergedError: Numbers are not finite any more.
        """
        memory, clock, periods = self._memory, self._memory.clock, self._periods
        now = due(clock, periods, until)
        while True:
            if now & LOGS:
                self._ask_wrench(clock[TIME])
                self.store(self._row()[np.newaxis])
                clock[ROWS] += 1.0
            if now & ENDS:
                return
            if now & ACTS:
                self._ask_wrench(clock[TIME])
                self._distribute(float(clock[TIME]))
                clock[STEPS] += 1.0
            bad, now = track_on(
                self._robot, self._own_law, self._rule.numbers, periods, self._at, until
            )
            if bad != INTEGRATION_OK:
                raise motion_problem(
                    self.control.robot, self.control.cables, self._rule.rule, bad, memory.state,
                    time=self.time,
                )  # fmt: skip

    def _ask_wrench(self, time: float) -> None:
        """Brings the wrench up to date, once for a time; the scenario's own always is."""
        tracking = self._tracking
        if tracking is None or time == self._asked_at:
            return
        memory = self._memory
        self._goal = tracking.given_motion(time, self._see)
        tracking.write_wrench(time, memory.state, self._goal, self._see, memory.wrench)
        self._asked_at = time

    def _distribute(self, time: float) -> None:
        memory = self._memory
        if self._distributor is not None:
            memory.tensions[:] = self._distributor.given_tensions(time, self._see)
            memory.verdicts[LAST_REQUEST_MET] = 1.0
            return
        code = update_tensions_at(
            self._distribution.table, memory.state, memory.wrench, memory.tensions, memory.verdicts
        )
        if code != FEASIBLE:
            memory.verdicts[REQUESTS_NOT_MET] += 1.0

    def _see(self, name: str) -> Array:
        """What stands at an output now."""
        memory = self._memory
        if name == "platform_state":
            return memory.state
        if name == "tensions":
            return memory.tensions
        if name == "desired_wrench":
            return memory.wrench
        if name == "lengths":
            out = np.empty((2, len(memory.tensions)))
            cable_motions(memory.state, self._cables, self._height, out)
            return out[0]
        block = self._tracking or self._distributor
        assert block is not None
        return block.view.see(memory.state, name, self.time)

    def _row(self) -> Array:
        memory = self._memory
        parts = [
            memory.clock[TIME : TIME + 1], memory.state, memory.wrench, memory.tensions,
            memory.verdicts[[LAST_REQUEST_MET, REQUESTS_NOT_MET]],
        ]  # fmt: skip
        if "desired_motion" in self.sizes:
            parts.append(self._goal)
        return np.concatenate(parts)

    def pose(self) -> RigidTransform:
        """X_WP of the platform [m]."""
        return pose_from_state(self.control.robot, self._memory.state)

    def errors(self) -> tuple[float, float]:
        """Distance [m] and angle [rad] of the platform from where it should be."""
        if "desired_motion" in self.sizes and self._asked_at >= 0.0:
            return pose_error(self.pose(), pose_from_row(self._goal[:7]))
        return pose_error(self.pose(), self.control.trajectory.pose(self.time))


def can_be_stepped(control: TensionControl) -> bool:
    """Whether a `RemoteTensionLoop` can take the place of a diagram."""
    stops = control.meters is not None and control.meters.stop is not None
    return control.outside is not None and control.motion is not None and not stops
