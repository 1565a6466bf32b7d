"""Many cable robots of one structure, moved at once by the kernels of the compiled engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cables.broken_cables import break_cables
from cdpr_drake.cables.models import cable_law
from cdpr_drake.cables.simulation_kernel import OUTPUTS, make_room, outputs_kernel
from cdpr_drake.dynamics.advance_events_kernel import fresh_memory
from cdpr_drake.dynamics.advance_kernel import REPORTED
from cdpr_drake.dynamics.batch_kernel import (
    advance_rows,
    cables_of_rows,
    outputs_address,
    reach_address,
    robot_tables,
    stacked_robots,
)
from cdpr_drake.dynamics.robot_arrays import APPLIED, MOTORS, TENSIONS
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_draws import Fitted, ParameterCovariance, drawn_robots
from cdpr_drake.models.robot_in_plant import pose_on_joint
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.numerics.kernel_calls import over_rows
from cdpr_drake.systems.batches.batch_inputs import as_poses, per_robot, robot_numbers
from cdpr_drake.systems.batches.batch_member import BatchMember
from cdpr_drake.systems.robots.cable_robot import default_rule
from cdpr_drake.systems.robots.compiled_step import StepRule, motion_problem, packed_rule
from cdpr_drake.systems.robots.settings import CableRobotSettings
from cdpr_drake.systems.sections import Section, sections_of


@dataclass(frozen=True)
class BatchState:
    """All that what follows depends on, of every robot: from `BatchRobots.save_state`."""

    arrays: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class BatchRollout:
    """What robots reached, from `BatchRobots.rollout`.

    Attributes:
        times: At the ends of the ways, shape (ways, count) [s].
        states: Of platform and winches then, as of `BatchRobots.states`, shape (ways, count, n).
        running: Which robots did not fail, shape (count,).
    """

    times: Array
    states: Array
    running: np.ndarray


class BatchRobots:
    """Many cable robots of one structure, each with its own parameters and state.

    Each moves as it does alone in `CompiledCableRobot` or `motion_by_tensions` with
    `command_period=HELD`, to the last bit, also by any number of threads: what moves it is the same
    machine code. Commands, wrenches and
    what is read are arrays with a row for each robot.

    A robot that fails, since a cable cannot run or numbers are not finite any more, stops in its
    last good state, and the others go on. `failed` tells which; `reset` puts it back.

    Attributes:
        robot: The robot, whose structure all have.
        robots: Each robot with its own parameters.
        count: Number of robots.
        cables: Cables of each, m.
        commands_per_robot: Numbers of a command, k: m, or fewer where winches wind several cables.
        rule: How they are integrated.
        threads: Threads that move them; None: as many as cores.
    """

    def __init__(
        self,
        robot: Robot | str | Path,
        count: int,
        *,
        settings: CableRobotSettings | None = None,
        rule: StepRule | None = None,
        parameters: Sequence[Robot] | None = None,
        by_tensions: bool = False,
        threads: int | None = None,
    ) -> None:
        """All robots at rest at their home poses, at time 0.

        Args:
            robot: The robot, by name, path, or itself.
            count: Number of robots.
            settings: Cables, winches and damping, as sections of a scenario have them; the
                defaults where None.
            rule: How they are integrated; `default_rule` of `robot`, as `CompiledCableRobot` has,
                if None.
            parameters: The robot of each row, of the same structure, with parameters of its own;
                None: all are as `robot`.
            by_tensions: Tensions are commanded, of massless cables, instead of winches.
            threads: Threads that move them; None: as many as cores.

        Raises:
            CdprError: The count is not positive, the parameters are not of this structure, or
                settings need a plant or a diagram.
            CableModelError: The cables' model cannot describe the robot's cables.
            CableGeometryError: At a home pose a cable cannot run over its pulley.
            InfeasibleTensionError: A robot cannot hold its home pose.
            RobotFileError: Winches with motors are asked for that the robot's file does not
                describe.
        """
        settings, robot = settings or CableRobotSettings(), as_robot(robot, "BatchRobots")
        if count < 1:
            raise CdprError(f"count: found {count}; accepted: 1 or more")
        robots = [robot] * count if parameters is None else list(parameters)
        _check(settings, robots, count, by_tensions)
        rule = default_rule(robot, settings, by_tensions) if rule is None else rule
        self.robot, self.robots, self.count = robot, robots, count
        self.rule, self.threads = rule, threads
        self._settings, self._by_tensions = settings, by_tensions
        made: dict[int, BatchMember] = {}  # of one robot in many rows only once
        self._members: list[BatchMember] = []
        for each in robots:
            if id(each) not in made:
                made[id(each)] = BatchMember.of(each, settings, by_tensions)
            self._members.append(made[id(each)])
        _check_structure(self._members)
        first = self._members[0]
        drive = self._drive = first.drive
        self._stack = stacked_robots([each.arrays for each in self._members])
        self._reach()
        m = self.cables = first.cables.count
        self._of_cable = drive.winch_of_cable(m)
        self.commands_per_robot = max(self._of_cable) + 1
        self._n, self._floats = first.joint.num_states, first.joint.is_floating
        self._size = self._n + m * drive.states_per_cable()
        law = cable_law(first.model, first.cables)
        rooms = [make_room(m, law, each.joint.height) for each in self._members]
        self._rooms = np.array(rooms)
        self._fresh_rooms = self._rooms.copy(), self._stack.room.copy()
        self._whole, self._broken = self._stack.cables.copy(), np.zeros((count, m))
        self._present = np.zeros((count, self._size + 1 + REPORTED))
        self._memory = np.tile(fresh_memory(self._size, m), (count, 1))
        self._commands, self._others = np.zeros((count, m)), np.zeros((count, 2, m))
        self._results = np.full(count, INTEGRATION_OK)
        self._table: Array | None = None
        boxes = [(one.box_center(), 0.5 * one.platform.size) for one in robots]
        self._boxes = np.array(boxes, float)
        self._at_rest: dict[int, tuple[bytes, tuple[Array, Array]]] = {}
        self.reset()

    def _reach(self) -> None:
        """Finds the kernels, and where the arrays are for them."""
        first = self._members[0]
        self._packed = packed_rule(self.rule, self._drive)
        self._outputs = outputs_kernel(cable_law(first.model, first.cables))
        self._tables = robot_tables(self._stack)

    def __getstate__(self) -> dict[str, Any]:
        """All but kernels, addresses of arrays, and what is kept by the identity of members."""
        left = {"_packed", "_outputs", "_tables"}
        state = {name: value for name, value in self.__dict__.items() if name not in left}
        return state | {"_at_rest": {}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """A copy goes on as the original would, to the last bit, on arrays of its own."""
        self.__dict__.update(state)
        self._reach()

    @classmethod
    def drawn(
        cls,
        robot: Robot | str | Path,
        count: int,
        covariance: Fitted | ParameterCovariance | Path | str,
        seed: int = 0,
        **how: Any,
    ) -> Self:
        """Robots whose parameters are drawn about those of one, as `drawn_robots`.

        Args:
            robot: The robot in the middle, as the file `robot.yaml` that `cdpr calibrate` or
                `cdpr identify` wrote.
            count: Number of robots.
            covariance: Of its parameters: such a folder, its results.json, a result, or a
                `ParameterCovariance`.
            seed: Of the random numbers; robot k is the same whatever the count.
            how: As for `BatchRobots`: settings, rule, by_tensions, threads.

        Raises:
            CdprError: As `drawn_robots` and `BatchRobots`.
        """
        middle = as_robot(robot, "BatchRobots")
        return cls(middle, count, parameters=drawn_robots(middle, count, covariance, seed), **how)

    # --- Movement -------------------------------------------------------------------------------

    def reset(
        self,
        robots: object = None,
        poses: object = None,
        tensions: object = None,
    ) -> Array:
        """Puts robots at rest, whole, at time 0, with lengths that hold them there.

        As `CableRobot.set_at_equilibrium`; a robot with fewer cables than degrees of freedom rests
        near the pose.

        Args:
            robots: Which: a mask, shape (count,), or numbers of robots; None: all.
            poses: X_WP for all of them, in one of the ways of `as_pose`, or one for each: rows as
                of `pose_row`, shape (k, 7), or matrices, shape (k, 4, 4) [m]; None: home.
            tensions: With which the cables hold the platform there, shape (m,) or (k, m) [N];
                None: those of least norm that balance its weight. Others set it in motion.

        Returns:
            Tensions at the platform, shape (k, m) [N].

        Raises:
            CdprError: An array is of another shape.
            InfeasibleTensionError: A robot cannot hold its pose, as `hold_robot`.
            CableGeometryError: A cable cannot run there.
        """
        rows = robot_numbers(robots, self.count)
        X = as_poses(self.robot, poses, len(rows))
        wanted = None
        if tensions is not None:
            wanted = per_robot("tensions", tensions, len(rows), self.cables)
        states, held = np.empty((len(rows), self._size)), np.empty((len(rows), self.cables))
        for k, row in enumerate(rows):
            pose = None if X is None else X[k]
            states[k], held[k] = self._start(row, pose, None if wanted is None else wanted[k])
        self._present[rows] = 0.0
        self._present[rows, : self._size] = states
        self._broken[rows], self._stack.cables[rows] = 0.0, self._whole[rows]
        self._stack.guesses[rows], self._results[rows] = 0.0, INTEGRATION_OK
        self._rooms[rows], self._stack.room[rows] = (each[rows] for each in self._fresh_rooms)
        self._others[rows] = 0.0
        self._commands[rows] = held if self._drive.kind == TENSIONS else 0.0
        self._stack.body[rows, APPLIED] = 0.0
        self._table = None
        return held

    def _start(
        self, row: int, X_WP: RigidTransform | None, tensions: Array | None
    ) -> tuple[Array, Array]:
        """State at rest and tensions; kept where nothing is commanded, as episodes mostly begin."""
        member = self._members[row]
        X_WP = as_pose(member.robot, X_WP)
        place = X_WP.GetAsMatrix4().tobytes()
        if tensions is not None:
            return member.at_rest(X_WP, tensions)
        if id(member) not in self._at_rest or self._at_rest[id(member)][0] != place:
            self._at_rest[id(member)] = place, member.at_rest(X_WP)
        return self._at_rest[id(member)][1]

    def step(
        self,
        commands: object,
        duration: float,
        *,
        rates: object = None,
        brakes: object = None,
        wrenches: object = None,
    ) -> np.ndarray:
        """Moves all robots on by a duration, in one compiled call; commands hold that long.

        Args:
            commands: What `CompiledCableRobot` takes: cable velocities [m/s], unstrained lengths
                [m] or torques [N m] by the mode of the winches, or tensions [N]; shape (k,) for all
                or (count, k).
            duration: For how long [s].
            rates: By which commanded lengths change, of winches by position, so that they are the
                command at the end; shaped as commands [m/s]. None: not.
            brakes: 1 where a motor's brake holds, shaped as commands; None: none. Robots need
                `winch.brake_torque` in their files, and winches with motors.
            wrenches: What acts on the platforms meanwhile beside cables and weight, moment about Po
                and force in W, shape (6,) or (count, 6) [N m, N]; None: nothing.

        Returns:
            Which robots go on, shape (count,): all but `failed`.

        Raises:
            CdprError: An array is of another shape or not finite, the duration not positive, or
                there are rates or brakes that the winches do not have.
        """
        self._move([commands], duration, wrenches, rates=rates, brakes=brakes)
        return ~self.failed

    def rollout(self, commands: Any, period: float, *, wrenches: object = None) -> BatchRollout:
        """Moves all robots along commands that hold for a period each, in one compiled call.

        It ends where as many calls of `step` end, to the last bit.

        Args:
            commands: As of `step`, for each period, shape (ways, k) for all or (ways, count, k).
            period: For how long each holds [s].
            wrenches: As of `step`, all the time.

        Returns:
            What was reached at the ends of the periods; of a robot that fails, its last good state
            from then on.

        Raises:
            CdprError: As `step`.
        """
        ways = list(np.asarray(commands, float)) if np.ndim(commands) in (2, 3) else []
        if not ways:
            raise CdprError(
                f"commands: found shape {np.shape(commands)}; accepted: (ways, "
                f"{self.commands_per_robot}) or (ways, {self.count}, {self.commands_per_robot})"
            )
        shape = (len(ways), *self._present.shape)
        reached = self._move(ways, period, wrenches, reached=np.empty(shape))
        size = self._size
        return BatchRollout(reached[:, :, size], reached[:, :, :size], ~self.failed)

    def _move(
        self, ways: Sequence[object], duration: float, wrenches: object, *,
        rates: object = None, brakes: object = None, reached: Array | None = None,
    ) -> Array:  # fmt: skip
        """Checks what is commanded, and moves on by a duration for each of some commands."""
        k, count = self.commands_per_robot, self.count
        if not (duration > 0.0 and np.isfinite(duration)):
            raise CdprError(f"duration: found {duration:g} s; accepted: more than 0")
        asked = np.empty((len(ways), count, self.cables))
        for way, given in zip(asked, ways, strict=True):
            way[:] = per_robot("commands", given, count, k)[:, self._of_cable]
        others = np.zeros_like(self._others)
        for row, (what, given) in enumerate((("rates", rates), ("brakes", brakes))):
            if given is not None:
                self._check_has(what)
                others[:, row] = per_robot(what, given, count, k)[:, self._of_cable]
        self._apply(None if wrenches is None else per_robot("wrenches", wrenches, count, 6))
        self._commands[:], self._others[:] = asked[-1], others
        if reached is None:
            reached = np.empty((0, *self._present.shape))
        over_rows(
            advance_rows, count, self.threads, reach_address(self._packed.reach), self._tables,
            self._packed.numbers, self._present, asked, self._others, duration, self._memory,
            reached, self._results,
        )  # fmt: skip
        self._table = None
        return reached

    def _check_has(self, what: str) -> None:
        """Checks that the winches take rates, or have brakes."""
        motors, mode = self._drive.kind == MOTORS, self._drive.mode
        found = f"winches by {mode}" if motors else "winches without motors"
        if what == "rates" and not (motors and mode == "position"):
            raise CdprError(f"rates: found {found}; accepted: winches with motors, by position")
        if what == "brakes":
            laws = [one.drive.law for one in self._members]
            bare = [row for row, law in enumerate(laws) if law is None or law.brake_torque == 0.0]
            if motors and not bare:
                return
            if motors:
                found = f"no winch.brake_torque in the file of robot {bare[0]}"
            raise CdprError(f"brakes: found {found}; accepted: motors with winch.brake_torque")

    def _apply(self, wrenches: Array | None) -> None:
        """As `apply_wrench`, for each robot."""
        body = self._stack.body
        body[:, APPLIED] = 0.0 if wrenches is None else 1.0
        if wrenches is None:
            return
        if self._floats:  # whose map is one
            body[:, APPLIED + 1 : APPLIED + 7] = wrenches
            return
        for row, each in enumerate(self._members):
            force = each.joint.wrench_map() @ wrenches[row]
            body[row, APPLIED + 1 : APPLIED + 1 + len(force)] = force

    def break_cable(self, robots: object, cable: int) -> None:
        """Breaks a cable of some robots: it pulls nothing from now on, until they are reset.

        Args:
            robots: As for `reset`, or the number of one robot.
            cable: Number of the cable, from 0.

        Raises:
            CdprError: There is no such robot or cable, or tensions are commanded.
        """
        rows = robot_numbers(robots, self.count)
        if not 0 <= cable < self.cables:
            raise CdprError(f"cable: found {cable}; accepted: 0 to {self.cables - 1}")
        if self._drive.kind == TENSIONS:
            raise CdprError(
                "break_cable: found robots by tensions; accepted: robots with winches; a tension "
                "of 0 is a cable that pulls nothing"
            )
        self._broken[rows, cable] = 1.0
        for row in rows:
            break_cables(self._whole[row], self._broken[row], self._stack.cables[row])
        self._table = None

    def exchange(self, row: int, robot: Robot | BatchMember) -> None:
        """Gives a robot other parameters from now on, while it moves or before it is reset.

        Its state stays, that is platform and winches, and which cables are broken.

        Args:
            row: Number of the robot.
            robot: Of the same structure, with parameters of its own; or what was made of it.

        Raises:
            CdprError: There is no such row, or the robot is of another structure.
            CableModelError: As `BatchRobots`, and so on.
        """
        (row,) = robot_numbers(int(row), self.count)
        if isinstance(robot, Robot):
            robot = BatchMember.of(robot, self._settings, self._by_tensions)
        member, robot = robot, robot.robot
        _check_structure([self._members[0], member])
        self.robots[row], self._members[row] = robot, member
        applied = self._stack.body[row, APPLIED:].copy()
        for rows, own in zip(self._stack, member.arrays, strict=True):
            rows[row] = own
        self._stack.body[row, APPLIED:] = applied
        self._whole[row] = member.arrays.cables
        break_cables(self._whole[row], self._broken[row], self._stack.cables[row])
        self._rooms[row] = self._fresh_rooms[0][row]
        self._boxes[row] = robot.box_center(), 0.5 * robot.platform.size
        self._at_rest = {id(each): self._at_rest[id(each)] for each in self._members
                         if id(each) in self._at_rest}  # fmt: skip
        self._table = None

    def set_twists(self, robots: object, twists: object) -> None:
        """Gives platforms velocities, as a blow would; what their joint cannot do is left out.

        Args:
            robots: Which, as for `reset`.
            twists: Angular velocity and velocity of Po in W, shape (6,) or (k, 6) [rad/s, m/s].

        Raises:
            CdprError: There is no such robot, or an array is of another shape.
        """
        rows = robot_numbers(robots, self.count)
        for row, twist in zip(rows, per_robot("twists", twists, len(rows), 6), strict=True):
            joint = self._members[row].joint
            speeds = twist if self._floats else joint.wrench_map() @ twist
            self._present[row, self._n - joint.num_velocities : self._n] = speeds
        self._table = None

    # --- What is read ---------------------------------------------------------------------------

    @property
    def times(self) -> Array:
        """Time of each robot since it was reset, shape (count,) [s]."""
        return self._present[:, self._size].copy()

    @property
    def states(self) -> Array:
        """State of platform and winches as `dynamics` has it, shape (count, n)."""
        return self._present[:, : self._size].copy()

    @property
    def poses(self) -> Array:
        """X_WP as rows of `pose_row`, (qw, qx, qy, qz, x, y, z), shape (count, 7) [-, m]."""
        if self._floats:
            rows = self._present[:, :7].copy()
            rows[rows[:, 0] < 0.0, :4] *= -1.0
            return rows
        pairs = zip(self._members, self._present[:, : self._n], strict=True)
        return np.array([pose_row(pose_on_joint(one.joint, state)) for one, state in pairs])

    @property
    def twists(self) -> Array:
        """Angular velocity and velocity of Po in W, shape (count, 6) [rad/s, m/s]."""
        speeds = self._present[:, self._n - self._members[0].joint.num_velocities : self._n]
        if self._floats:
            return speeds.copy()
        pairs = zip(self._members, speeds, strict=True)
        return np.array([one.joint.wrench_map().T @ each for one, each in pairs])

    @property
    def lowest_points(self) -> Array:
        """Height in W of the lowest corner of each platform's box, shape (count,) [m].

        Nothing of a batch is touched: whoever has a floor looks here, and resets what stands on it.
        """
        w, x, y, z, _, _, height = self.poses.T
        up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
        corner = np.zeros(self.count)
        for k in range(3):  # along one axis of P after the other, so that no sum depends on counts
            middle, half = self._boxes[:, 0, k], self._boxes[:, 1, k]
            corner = corner + up[k] * middle - np.abs(up[k]) * half
        return np.asarray(height + corner)

    @property
    def lengths(self) -> Array:
        """Unstrained lengths, shape (count, m) [m].

        Raises:
            CdprError: Tensions are commanded: such cables have none.
        """
        if self._drive.kind == TENSIONS:
            raise CdprError("lengths: found robots by tensions; accepted: robots with winches")
        return self._present[:, self._n : self._n + self.cables].copy()

    @property
    def tensions(self) -> Array:
        """At the platform, under the commands that hold, shape (count, m) [N]."""
        if self._drive.kind == TENSIONS:
            return np.maximum(self._commands, 0.0)
        return self._cables()[:, 0].copy()

    @property
    def drum_tensions(self) -> Array:
        """At the exit points, shape (count, m) [N]."""
        if self._drive.kind == TENSIONS:
            return self.tensions
        return self._cables()[:, 1].copy()

    @property
    def failed(self) -> np.ndarray:
        """Which robots failed and stand still, shape (count,)."""
        return self._results != INTEGRATION_OK

    @property
    def broken(self) -> np.ndarray:
        """Which cables are broken, shape (count, m)."""
        return self._broken != 0.0

    def problem(self, row: int) -> Exception | None:
        """What a robot failed by; None: it did not."""
        bad, state = int(self._results[row]), self._present[row]
        if bad == INTEGRATION_OK:
            return None
        return motion_problem(
            self.robots[row], self._members[row].cables, self.rule, bad, state[: self._size],
            time=float(state[self._size]),
        )  # fmt: skip

    def _cables(self) -> Array:
        """What cables do, rows as of `simulation_kernel.OUTPUTS`, shape (count, 6, m)."""
        if self._table is None:
            m = self.cables
            if self._drive.kind == MOTORS:
                rates = np.ascontiguousarray(self._present[:, self._n + m : self._n + 2 * m])
            else:
                limits = self._stack.winch[:, 0, :1]
                rates = np.maximum(np.minimum(self._commands, limits), -limits)
            table, results = np.zeros((self.count, OUTPUTS, m)), np.empty(self.count, np.int64)
            over_rows(
                cables_of_rows, self.count, self.threads, outputs_address(self._outputs), self._n,
                self._present, rates, self._stack.cables, self._rooms, table, results,
            )  # fmt: skip
            table[results >= 0] = np.nan
            self._table = table
        return self._table

    # --- What is kept ---------------------------------------------------------------------------

    def _kept(self) -> tuple[np.ndarray, ...]:
        stack = self._stack
        return (
            self._present, self._commands, self._others, self._results, self._broken,
            stack.cables, stack.body, stack.room, stack.guesses, self._rooms,
        )  # fmt: skip

    def save_state(self) -> BatchState:
        """All that what follows depends on: `load_state` goes on from here, to the last bit."""
        return BatchState(tuple(each.copy() for each in self._kept()))

    def load_state(self, state: BatchState, robots: object = None) -> None:
        """Goes back to a state of these robots, or of a batch made in the same way.

        Args:
            state: From `save_state`.
            robots: Which robots, as for `reset`; None: all.

        Raises:
            CdprError: It is that of other robots.
        """
        kept = self._kept()
        if [each.shape for each in state.arrays] != [each.shape for each in kept]:
            raise CdprError(
                f"state: found one of {len(state.arrays[0])} robots or of other ones; accepted: "
                f"one of {self.count} robots made as these"
            )
        rows = robot_numbers(robots, self.count)
        for now, then in zip(kept, state.arrays, strict=True):
            now[rows] = then[rows]
        self._table = None


def _check(
    settings: CableRobotSettings, robots: Sequence[Robot], count: int, by_tensions: bool
) -> None:
    if len(robots) != count:
        raise CdprError(f"parameters: found {len(robots)} robots; accepted: {count}, as counted")
    if getattr(settings, "world", None) is not None:
        raise CdprError(
            "world: found a section; accepted in a batch: null, since the compiled engine has no "
            "contact and measures no clearances; lowest_points tells who is at a floor"
        )
    pushing = [key for key, one in sections_of(settings) if type(one).push is not Section.push]
    for name in pushing if settings.failures is None else ("failures",):
        raise CdprError(
            f"{name}: found a section; accepted in a batch: null, with wrenches and break_cable "
            "between steps"
        )
    creeping = max((each.cable_behaviour().creep_stiffness for each in robots), default=0.0)
    if creeping > 0.0:
        raise CdprError(
            f"cable.behaviour.creep_stiffness: found {creeping:g}; accepted in a batch: 0"
        )
    if any(each.contact_hysteresis() is not None for each in robots):
        raise CdprError("platform.hysteresis: found a section; accepted in a batch: null")
    if by_tensions and settings.winches.has_motors():
        raise CdprError("winches.kind: found motor for robots by tensions; accepted: ideal")


def _check_structure(members: Sequence[BatchMember]) -> None:
    """Checks that robots have the same sizes and kinds."""
    first = members[0].arrays
    for row, member in enumerate(members):
        pairs = zip(first, member.arrays, strict=True)
        same = all(mine.shape == other.shape for mine, other in pairs)
        if not same or not np.array_equal(first.kinds, member.arrays.kinds):
            raise CdprError(
                f"parameters: found robot {row} with another number of cables, motion type or "
                "winch than robot 0; accepted: robots of one structure"
            )
