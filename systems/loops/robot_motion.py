"""A cable robot in motion without a block: its state, and the kernels that move and read it."""

from __future__ import annotations

import math

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import cable_law
from cdpr_drake.cables.simulation_kernel import OUTPUTS, make_room, outputs_kernel
from cdpr_drake.cables.states import crept_at_rest
from cdpr_drake.dynamics.advance_events_kernel import fresh_memory, robot_addresses
from cdpr_drake.dynamics.advance_kernel import REPORTED
from cdpr_drake.dynamics.batch_kernel import outputs_address, reach_address
from cdpr_drake.dynamics.lone_robot_kernel import LoneRobot, move, see_cables
from cdpr_drake.dynamics.robot_arrays import CREEPING, MOTORS, RUBBING, pack_robot
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.errors import DivergedError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import floating_pose_into
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.numerics.kernel_calls import array_addresses
from cdpr_drake.systems.loops.loop_state import Part, held
from cdpr_drake.systems.robots.assembly import equilibrium_start
from cdpr_drake.systems.robots.cable_forces import simulated_cables
from cdpr_drake.systems.robots.compiled_cable_robot import winch_drive
from cdpr_drake.systems.robots.compiled_step import (
    PackedRule,
    StepRule,
    motion_problem,
    resting_state,
)
from cdpr_drake.systems.robots.settings import CableRobotSettings
from cdpr_drake.winches.motor import MODES
from cdpr_drake.winches.motor_kernel import pack_winch, winch_torques

TENSIONS, DRUM_TENSIONS, LENGTHS, SLACK, SURPLUS = range(5)
"""Rows of `RobotMotion.cables`, in the order of `simulation_kernel.model_outputs`."""


class RobotMotion:
    """What `CompiledMotion` is in a diagram, by the same kernels: winches follow velocities.

    Attributes:
        robot: The robot.
        rule: How it is integrated.
        has_motors: Whether motors drive the winches.
        report: Errors and numbers of steps so far, as `advance_kernel.REPORTED` says, shape (4,).
    """

    def __init__(
        self,
        robot: Robot,
        settings: CableRobotSettings,
        rule: StepRule,
        like: RobotMotion | None = None,
    ) -> None:
        """A robot at rest at its home pose, and how it is integrated.

        Args:
            robot: The robot.
            settings: Its cables, winches and damping.
            rule: How it is integrated.
            like: A motion of the same robot and settings, whose constants it shares; its arrays
                are its own.

        Raises:
            CableModelError: The cables' model cannot describe the robot's cables.
            CableGeometryError: At the home pose a cable cannot run over its pulley.
            RobotFileError: Winches with motors are asked for that the robot's file does not
                describe.
        """
        self.robot, self.rule = robot, rule
        self._model = settings.cables.model_of(robot)
        if like is None:
            self._set = simulated_cables(settings.cables.cable_set(robot), self._model)
            self._drive = winch_drive(robot, settings.winches)
            self._home = cable_paths(robot.home.transform(), self._set).lengths
            self._joint, self._body = robot.joint(), rigid_platform(robot)
        else:
            self._set, self._drive, self._home = like._set, like._drive, like._home
            self._joint, self._body = like._joint, like._body
        joint = self._joint
        self._arrays = pack_robot(
            self._body, self._set, self._model, self._drive,
            home=self._home, joint=joint, damping=settings.damping.of(robot),
            contacts=robot.contact_hysteresis(),
        )  # fmt: skip
        law = cable_law(self._model, self._set)
        self._room = make_room(self._set.count, law, joint.height)
        rooms = self._room, self._arrays.room, self._arrays.guesses
        self._searched = [(searched, searched.copy()) for searched in rooms]
        m, n = self._set.count, joint.num_states
        size = self._arrays.work.shape[1]
        # State, its time and the report, as they are now.
        self._present = np.zeros(size + 1 + REPORTED)
        self._state, self.report = self._present[:size], self._present[size + 1 :]
        self._platform, self._winches = self._state[:n], self._state[n:]
        self._lengths, self._speeds = self._winches[:m], self._winches[m : 2 * m]
        self._command, self._released, self._torques = np.zeros(m), np.zeros(m), np.zeros((2, m))
        self.has_motors = self._drive.kind == MOTORS
        self._memory, self._table = fresh_memory(size, m), np.zeros((OUTPUTS, m))
        packed = PackedRule(rule)
        self._kernel_arrays = LoneRobot(
            np.array([reach_address(packed.reach), outputs_address(outputs_kernel(law)), n]),
            packed.numbers, self._present, self._command, np.zeros((2, m)), self._memory,
            self._arrays.cables, self._room, self._table,
            self._state[size - self._arrays.kinds[CREEPING] :],
            self._speeds if self.has_motors else np.zeros(m),
            np.array([np.nan if self.has_motors else self._arrays.winch[0, 0]]),
        )  # fmt: skip
        self._robot, self._at = robot_addresses(self._arrays), array_addresses(self._kernel_arrays)
        # Of what is present: the pose as an object, whether its matrix and the table are known.
        self._pose: RigidTransform | None = None
        self._posed = self._known = False
        self._matrix = np.empty((3, 4))

    def resting(
        self, X_WP: RigidTransform, slack: Array | None = None, at_rest: bool = False
    ) -> Array:
        """State of platform and winches at rest at a pose [m], shape (n,).

        As `CableRobot.set_at_equilibrium`, and raises as that does.
        """
        X_WP, holding = equilibrium_start(
            self.robot, self._set, self._model, X_WP, slack=slack, at_rest=at_rest
        )
        lengths = holding.unstrained_lengths
        state = resting_state(
            self.robot, self._drive, X_WP, lengths, holding.drum_tensions, home=self._home
        )
        unbent = np.zeros(self._arrays.kinds[RUBBING])
        return np.concatenate([state, unbent, crept_at_rest(self._set, X_WP, lengths)])

    def begin(self, state: Array) -> None:
        """Puts platform and winches into a state at time 0, shape (n,)."""
        self._present[:] = 0.0
        self._state[:] = state
        # What was reached, and where sagging cables were found, by a run before is not this one's.
        self._memory[2 * len(self._present)] = np.nan
        for searched, fresh in self._searched:
            searched[:] = fresh
        self.command(self._released)
        self._pose, self._posed = None, False

    def kept(self) -> list[Part]:
        """All that what follows depends on, as parts of a loop's state; where catenaries were found
        last, too, since their search begins there."""
        return [
            held("motion", self._present), held("command", self._command),
            held("room", self._room), held("guesses", self._arrays.guesses),
            held("searches", self._arrays.room),
        ]  # fmt: skip

    def forget(self) -> None:
        """Computes anew what was computed of a state, after another was put in its place."""
        self._pose, self._posed = None, False
        self.command(self._command)

    def command(self, velocities: Array) -> None:
        """Commands cable velocities from now on, shape (m,) [m/s], positive pays out."""
        self._command[:] = velocities
        self._known = False

    def advance(self, time: float) -> None:
        """Moves on to a time [s], in one call.

        Raises:
            CableGeometryError: A cable cannot run.
            DivergedError: Numbers are not finite any more.
        """
        bad = move(self._at, self._robot, time)
        self._pose, self._posed, self._known = None, False, False
        if bad != INTEGRATION_OK:
            raise self._problem(bad, time)

    def pose(self) -> RigidTransform:
        """X_WP now [m]."""
        if self._pose is None:
            self._pose = RigidTransform.MakeUnchecked(self.pose_matrix())
        return self._pose

    def pose_matrix(self) -> Array:
        """Matrix (3, 4) of X_WP now [-, m]; the same array each time."""
        if not self._posed:
            if self._joint.is_floating:
                if not 0.0 < floating_pose_into(self._platform, self._matrix) < math.inf:
                    raise DivergedError("the platform's quaternion is no orientation any more")
            else:
                self._matrix[:] = self._joint.pose_at(self._platform).GetAsMatrix34()
            self._posed = True
        return self._matrix

    def platform_state(self) -> Array:
        """State of the platform now as the plant would have it; do not write into it."""
        return self._platform

    def length_rates(self) -> Array:
        """Rates of the unstrained lengths of winches with motors, shape (m,) [m/s]."""
        return self._speeds

    def unstrained_lengths(self) -> Array:
        """Those of now, shape (m,) [m]."""
        return self._lengths

    def cables(self) -> Array:
        """What the cables do now, under the command that holds, rows as `TENSIONS` names them; the
        same array each time.

        Raises:
            CableGeometryError: A cable cannot run.
        """
        if not self._known:
            bad = see_cables(self._at)
            if bad >= 0:
                raise self._problem(bad, self._present[len(self._state)])
            self._known = True
        return self._table

    def torques(self) -> Array:
        """Applied torques and what friction takes up, of motors on the winches, (2, m) [N m]."""
        law = self._drive.law
        assert law is not None
        winch_torques(
            self._winches, self.cables()[DRUM_TENSIONS], self._command, self._released,
            self._home, MODES[self._drive.mode], pack_winch(law), self._torques,
        )  # fmt: skip
        return self._torques

    def _problem(self, bad: int, time: float) -> Exception:
        return motion_problem(self.robot, self._set, self.rule, bad, self._state, time=time)
