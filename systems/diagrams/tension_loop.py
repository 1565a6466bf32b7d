"""The loop of dynamic control without its diagram: one compiled call for many control steps."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.dynamics.advance_events_kernel import robot_addresses
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.dynamics.tracking_kernel import TIME, start_tracking, track
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_in_plant import pose_on_joint
from cdpr_drake.systems.controllers.computed_torque import PoseTracking
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.tension_control import TensionControl
from cdpr_drake.systems.robots.compiled_step import PackedRule, motion_problem
from cdpr_drake.systems.robots.settings import COMPILED


class TensionRows:
    """Rows of a `TensionControl`'s log that a loop without its diagram holds.

    Attributes:
        control: The control.
        sizes: What stands side by side in a row, with sizes.
    """

    def __init__(self, control: TensionControl, states: int) -> None:
        """None yet, with so many states of the platform."""
        self.control = control
        self.sizes = {
            "time": 1,
            "platform_state": states,
            "desired_wrench": 6,
            "tensions": control.cables.count,
            "feasible": 1,
            "failures": 1,
        }
        self._stored: list[Array] = []

    def store(self, rows: Array) -> None:
        """Holds rows, shape (n, width), which do not change any more."""
        self._stored.append(rows)

    def width(self) -> int:
        """Numbers of a row."""
        return sum(self.sizes.values())

    def rows(self, _: object = None) -> int:
        """Number of rows of the log that are held."""
        return sum(len(piece) for piece in self._stored)

    def read_log(self, _: object = None) -> dict[str, Array]:
        """The log since it was cleared, as `TensionControl.read_log` gives it."""
        return self.control.whole_log(self.columns())

    def columns(self) -> dict[str, Array]:
        """What is stored: "time", shape (n,) [s], and by name, shape (n, size), as `sizes` has it;
        what `read_log` makes of these for each row takes its time."""
        rows = np.concatenate(self._stored) if self._stored else np.empty((0, self.width()))
        columns, end = {}, 0
        for name, size in self.sizes.items():
            columns[name] = rows[:, end : end + size]
            end += size
        columns["time"] = columns["time"][:, 0]
        return columns

    def clear(self, _: object = None) -> None:
        """Forgets the rows; what comes is logged as before."""
        self._stored.clear()


class TensionLoop(TensionRows):
    """What a `TensionControl` with compiled steps does, step for step, without its diagram.

    Constants are those of the diagram's blocks, laws are the kernels that these call, and instants
    are the simulator's: state, tensions and log are the diagram's to the last bits. Blocks of
    somebody's own are not in it.
    """

    name = COMPILED

    def __init__(
        self, control: TensionControl, log_rate: float, start: RigidTransform | None = None
    ) -> None:
        """At the beginning of the trajectory, at rest.

        Args:
            control: The blocks; not changed but for their work space.
            log_rate: Rows of the log per second [Hz].
            start: X_WP at time 0 in the place of the trajectory's [m].

        Raises:
            CdprError: The robot is moved by a plant, or the distributor is somebody's own.
        """
        if not can_be_compiled(control):
            raise CdprError(
                f"tension loop of {control.robot.name}: found a plant, a distributor of one's "
                "own or a stop at contact; accepted: the engine compiled with TensionDistributor"
            )
        motion, blocks = control.motion, control.blocks
        assert motion is not None
        self._joint = control.robot.joint()
        self._motion, self._rule, self._log_rate = motion, PackedRule(motion.rule), log_rate
        self._law, self._distribution = blocks.controller.packed(), blocks.distributor.packed()
        self._robot = robot_addresses(motion.arrays())
        self._periods = np.array([1.0 / blocks.distributor.rate, 1.0 / log_rate])
        context = control.make_context()
        if start is not None:
            control.set_pose(context, start)
        resting = motion.state(motion.GetMyContextFromRoot(context))
        self._memory = start_tracking(resting, self._distribution.bounds[0])
        super().__init__(control, len(resting))
        self.advance_to(0.0)

    @property
    def time(self) -> float:
        """Time that is reached [s]."""
        return float(self._memory.clock[TIME])

    def advance_to(self, time: float) -> None:
        """Goes on to a time [s].

        Raises:
            CableGeometryError: A cable cannot run.
            DivergedError: Numbers are not finite any more.
        """
        count = int((time - self.time) * self._log_rate) + 3
        rows = np.empty((count, self.width()))
        bad, written = track(
            self._robot,
            self._law.table,
            self._distribution.table,
            self._rule.numbers,
            self._periods,
            self._memory,
            float(time),
            rows,
        )
        if written:
            self.store(rows[:written].copy())
        if bad != INTEGRATION_OK:
            raise motion_problem(
                self.control.robot,
                self.control.cables,
                self._rule.rule,
                bad,
                self._memory.state,
                time=self.time,
            )

    def state(self) -> Array:
        """State of the platform, shape (n,)."""
        return self._memory.state.copy()

    def pose(self) -> RigidTransform:
        """X_WP of the platform [m]."""
        return pose_on_joint(self._joint, self._memory.state)

    def errors(self) -> tuple[float, float]:
        """Distance [m] and angle [rad] of the platform from where it should be."""
        return pose_error(self.pose(), self.control.trajectory.pose(self.time))


def can_be_compiled(control: TensionControl) -> bool:
    """Whether a `TensionLoop` can take the place of a diagram."""
    blocks, meters = control.blocks, control.meters
    stops = meters is not None and meters.stop is not None
    own = type(blocks.distributor) is TensionDistributor and type(blocks.controller) is PoseTracking
    return control.motion is not None and own and not stops
