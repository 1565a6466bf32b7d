"""A cable robot that moves by itself, in compiled steps from one event to the next."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, FramePoseVector
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DependencyTicket,
    DiscreteValues,
    LeafSystem,
    ValueProducer,
    WitnessFunction,
    WitnessFunctionDirection,
)

from cdpr_drake.arrays import Array
from cdpr_drake.cables.behaving_kernel import put_crept
from cdpr_drake.cables.broken_cables import break_cables
from cdpr_drake.cables.commanded_tension_kernel import cable_motions
from cdpr_drake.cables.models import cable_law
from cdpr_drake.cables.simulation_kernel import OUTPUTS, guesses_of, make_room, outputs_kernel
from cdpr_drake.cables.states import crept_at_rest
from cdpr_drake.dynamics.advance_events_kernel import BACKWARD, fresh_memory, robot_addresses
from cdpr_drake.dynamics.advance_kernel import REPORTED, robot_energy
from cdpr_drake.dynamics.robot_arrays import (
    CREEPING,
    MOTORS,
    RUBBING,
    TENSIONS,
    Drive,
    RobotArrays,
    apply_wrench,
    pack_robot,
)
from cdpr_drake.dynamics.robot_kernel import INTEGRATION_OK, ideal_rates
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import pose_on_joint
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.systems.robots.assembly import equilibrium_start, resting_start
from cdpr_drake.systems.robots.cable_forces import CREPT, PORTS
from cdpr_drake.systems.robots.compiled_step import (
    StepRule,
    motion_problem,
    packed_rule,
    resting_state,
)
from cdpr_drake.systems.robots.failures import BROKEN, JAMMED, POWERLESS
from cdpr_drake.systems.robots.motor_winch import COMMAND_PORTS
from cdpr_drake.systems.robots.platform_hysteresis import BENT
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH
from cdpr_drake.systems.robots.random_pose import NUMBERS, RANDOM_NUMBERS, RandomPose
from cdpr_drake.winches.failed_winches import fail_winches, pack_failing_winches
from cdpr_drake.winches.motor import MODES
from cdpr_drake.winches.motor_kernel import winch_torques

MEMORY = "motion_memory"
"""Name of the port from which blocks without Python can read, see `CompiledMotion.parts`."""

HELD = math.inf
"""A `command_period`: commands are constant between the events of the diagram, which is checked."""


class CompiledMotion(LeafSystem):
    """Platform, cables and winches of a robot as one block.

    Ports are those of `CableRobot` without scene graph, or of `TensionDrivenCables` where tensions
    are commanded, and these:

    ====================== =============== ======== =============================================
    port                   type            unit     meaning
    ====================== =============== ======== =============================================
    commanded_length_rates vector(m)       m/s      in, may stay open; mode position only: by
                                                    which the commanded lengths change
    broken                 vector(m)       -        in, only if it may fail, as are the next two,
                                                    may stay open: not 0 for each cable that is
                                                    broken
    jammed                 vector(k)       -        in, for each winch that stands still
    powerless              vector(k)       -        in, with motors: for each that has no power
    geometry_pose          FramePoseVector m        out, of the platform's frame; not without one
    bent                   vector(3 or 1)  rad      out, only of a platform that rubs as it turns;
                                                    see `PlatformHysteresis`
    step_errors            vector(2)       m, rad   out, largest estimated error of one step so
                                                    far, in position and rotation
    steps                  vector(2)       -        out, steps taken, and taken back, so far
    motion_memory          vector          any      out, what all others are read from, with
                                                    `parts`; see `integrate_explicit`
    ====================== =============== ======== =============================================

    The state is discrete: that of the platform and the winches at the last event, and its time. At
    each step of the simulator, which goes from event to event, it is brought up to date; between
    events, outputs are the state of the motion at their own time.

    Commands and the applied wrench may be of any kind. The block samples them every
    `command_period` at the latest, by an event of its own, and at all other events of the diagram:
    at the beginning of each step, after all updates, and at its end. A command that is the same at
    both is constant in between, as those of sampled controllers are. A command that is not is taken
    as linear in between, and a wrench as its mean, so that errors are of second order in the period
    and do not depend on which other blocks have events. Commanded lengths whose rates are given
    change by these. A simulator that is initialized after the time was set back begins with the
    state of the last event.

    Raises CableGeometryError in a simulation where a cable cannot run, DivergedError where numbers
    are not finite any more.
    """

    def __init__(
        self,
        robot: Robot | str | Path,
        cables: CableSet,
        model: str,
        drive: Drive,
        *,
        damping: tuple[float, float] = (0.0, 0.0),
        rule: StepRule | None = None,
        frame: FrameId | None = None,
        command_period: float | None = None,
        may_fail: bool = False,
        random_pose: RandomPose | None = None,
    ) -> None:
        """Declares ports and state.

        Args:
            robot: The robot.
            cables: The cables as they are simulated, see `simulated_cables`.
            model: A name of `cables.CABLE_MODELS` but inextensible.
            drive: What drives the cables.
            damping: Of the platform, [N s/m] and [N m s/rad].
            rule: How it is integrated; `StepRule()` if None.
            frame: The platform's frame in a scene graph.
            command_period: Longest time between two samples of the commands [s]; None: the step of
                `rule`. `HELD`, infinite: only at events of the diagram, for commands that are held
                from event to event; a command that is not is refused as the simulation meets it.
            may_fail: Whether it has inputs for what fails; they count like commands. Not for
                tensions that are commanded.
            random_pose: Poses of random contexts, by an input random_numbers, shape (6,), uniform
                in 0..1; `default_numbers` there stand for the home pose. None: the home pose.

        Raises:
            CdprError: The period is not positive.
        """
        super().__init__()
        robot = as_robot(robot, "CompiledMotion")
        rule = StepRule() if rule is None else rule
        period = rule.max_step if command_period is None else command_period
        if not period > 0.0:
            raise CdprError(f"command_period: found {period:g} s; accepted: more than 0")
        self._robot, self._set, self._model, self._drive = robot, cables, model, drive
        m = self._m = cables.count
        self._home = cable_paths(robot.home.transform(), cables).lengths
        joint = self._joint = robot.joint()
        self._height = joint.height
        self._arrays = pack_robot(
            rigid_platform(robot), cables, model, drive,
            home=self._home, joint=joint, damping=damping, contacts=robot.contact_hysteresis(),
        )  # fmt: skip
        self._may_fail = may_fail and drive.kind != TENSIONS
        if self._may_fail and drive.law is not None:
            rows = pack_failing_winches(drive.law, m)
            self._arrays = self._arrays._replace(winch=rows)
        self._whole, self._whole_winch = self._arrays.cables.copy(), self._arrays.winch.copy()
        self._n = joint.num_states
        self._size = size = self._arrays.work.shape[1]
        self._where = robot_addresses(self._arrays)
        self._packed, self._held = packed_rule(rule, drive), not math.isfinite(period)
        # Where what was reached has all its values, the state, and the report.
        k = size + 1 + REPORTED
        self._values, self._own = slice(k, 2 * k), slice(k, k + size)
        self._platform, self._told = slice(k, k + self._n), slice(2 * k - REPORTED, 2 * k)
        self._still, self._calm = np.zeros(m), np.zeros((2, m))
        law = cable_law(model, cables)
        self._room, self._outputs = make_room(m, law, self._height), outputs_kernel(law)
        self._frame = frame
        self.not_at_rest = ""
        self._declare_inputs()
        # Depends on the state alone, which is a new one at the beginning of each step: so it is
        # kept until the step ends.
        self._begun = self.DeclareCacheEntry(
            "commands_at_begin",
            ValueProducer(lambda: Value(np.zeros(m + 6)), self._calc_begun),
            {self.xd_ticket()},
        ).Eval
        self._witness = self.MakeWitnessFunction(
            "commands_at_begin", WitnessFunctionDirection.kNone, self._see_begin
        )
        X_home = robot.home.transform()
        state = self._state_at(X_home, self._home, self._still)
        if drive.kind != TENSIONS:
            begin = resting_start(robot, X_home, cables, model)
            state, self.not_at_rest = (
                self._state_at(begin.X_WP, begin.lengths, begin.drum_tensions), begin.problem,
            )  # fmt: skip
        self._begin = np.concatenate([state, np.zeros(1 + REPORTED)])
        self.DeclareDiscreteState(self._begin)
        self._random, self._numbers, self.default_numbers = random_pose, None, np.zeros(NUMBERS)
        if random_pose is not None:
            self._numbers = self.DeclareVectorInputPort(RANDOM_NUMBERS, NUMBERS)
        everything = {self.time_ticket(), self.xd_ticket(), self.all_input_ports_ticket()}
        port = self.DeclareVectorOutputPort(
            MEMORY, BasicVector(fresh_memory(size, m)), self._calc_reached, everything
        )
        self._reached = port.Eval
        here = {port.cache_entry().ticket()}
        self._declare_platform(here)
        if drive.kind == TENSIONS:
            self._declare_driven(here)
        else:
            self._declare_cables(here)
        if drive.kind == MOTORS:
            self._declare_motors(here)
        self.DeclareInitializationDiscreteUpdateEvent(self._begin_anew)
        self.DeclarePerStepPublishEvent(self._look)
        self.DeclarePerStepDiscreteUpdateEvent(self._take)
        if not self._held:
            self.DeclarePeriodicPublishEvent(period, 0.0, self._look)

    @property
    def rule(self) -> StepRule:
        """How it is integrated; may be set at any time, for all contexts."""
        return self._packed.rule

    @rule.setter
    def rule(self, rule: StepRule) -> None:
        self._packed = packed_rule(rule, self._drive)

    def _declare_inputs(self) -> None:
        drive, m = self._drive, self._m
        mode = drive.mode if drive.kind == MOTORS else "velocity"
        name = "tensions" if drive.kind == TENSIONS else COMMAND_PORTS[mode]
        self._of_cable = drive.winch_of_cable(m)
        k = max(self._of_cable) + 1
        self._command = self.DeclareVectorInputPort(name, k)
        self._brakes = self._rates = None
        if drive.kind == MOTORS:
            assert drive.law is not None
            if drive.law.brake_torque > 0.0:
                self._brakes = self.DeclareVectorInputPort("brakes", k)
            if drive.mode == "position":
                self._rates = self.DeclareVectorInputPort("commanded_length_rates", k)
        self._plain = self._brakes is None and k == m
        self._wrench = self.DeclareVectorInputPort(APPLIED_WRENCH, 6)
        self._faults = {}
        if self._may_fail:
            self._plain = False
            self._faults = {BROKEN: self.DeclareVectorInputPort(BROKEN, m)}
            names = (JAMMED, POWERLESS) if drive.kind == MOTORS else (JAMMED,)
            self._faults |= {name: self.DeclareVectorInputPort(name, k) for name in names}

    def _declare_platform(self, here: set[DependencyTicket]) -> None:
        n, joint = self._n, self._joint

        def calc_state(context: Context, output: BasicVector) -> None:
            output.SetFromVector(self._reached(context)[self._platform])

        self.DeclareVectorOutputPort("platform_state", n, calc_state, here)

        def pose(context: Context) -> RigidTransform:
            return pose_on_joint(joint, self.state(context))

        def calc_poses(context: Context, output: AbstractValue) -> None:
            output.set_value([RigidTransform(), pose(context)])

        def calc_frames(context: Context, output: AbstractValue) -> None:
            frames = FramePoseVector()
            frames.set_value(self._frame, pose(context))
            output.set_value(frames)

        self.DeclareAbstractOutputPort(
            "X_WP",
            lambda: Value(RigidTransform()),
            lambda context, output: output.set_value(pose(context)),
            here,
        )
        self.DeclareAbstractOutputPort(
            "body_poses", lambda: Value[list[RigidTransform]](), calc_poses, here
        )
        if self._frame is not None:
            self.DeclareAbstractOutputPort(
                "geometry_pose", lambda: Value(FramePoseVector()), calc_frames, here
            )
        turns = self._arrays.kinds[RUBBING]
        if turns > 0:
            end = self._size - self._arrays.kinds[CREEPING]
            self._vector(BENT, turns, lambda c: self.state(c)[end - turns : end], here)
        self._vector("step_errors", 2, lambda context: self.report(context)[:2], here)
        self._vector("steps", 2, lambda context: self.report(context)[2:], here)

    def _declare_cables(self, here: set[DependencyTicket]) -> None:
        n, m = self._n, self._m
        needs = {*here, self.all_input_ports_ticket()}
        table = self.DeclareCacheEntry(
            "cables", ValueProducer(lambda: Value(np.zeros((OUTPUTS, m))), self._calc_cables), needs
        )

        def reader(row: int) -> Callable[[Context], Array]:
            return lambda context: table.Eval(context)[row]

        for row, name in enumerate(PORTS):
            self._vector(name, m, reader(row), {table.ticket()})
        self._vector("unstrained_lengths", m, lambda c: self.state(c)[n : n + m], here)
        if self._arrays.kinds[CREEPING] > 0:
            self._vector(CREPT, m, lambda c: self.state(c)[self._size - m :], here)
        if self._drive.kind == MOTORS:
            after = n + m
            self._vector("unstrained_length_rates", m, lambda c: self.state(c)[after:][:m], here)
        else:
            command = {self.input_port_ticket(self._command.get_index())}
            command |= {port.ticket() for port in self._faults.values()}
            self._vector("unstrained_length_rates", m, self._ideal_rates, command)

    def _declare_driven(self, here: set[DependencyTicket]) -> None:
        cables, m = self._arrays.cables, self._m

        def motions(context: Context, row: int) -> Array:
            out = np.empty((2, m))
            cable_motions(self.state(context)[: self._n], cables, self._height, out)
            return out[row]

        self._vector("lengths", m, lambda context: motions(context, 0), here)
        self._vector("length_rates", m, lambda context: motions(context, 1), here)
        command = {self.input_port_ticket(self._command.get_index())}
        self._vector(
            "slack", m, lambda context: (self._command.Eval(context) <= 0.0).astype(float), command
        )

    def _declare_motors(self, here: set[DependencyTicket]) -> None:
        law, n, m = self._drive.law, self._n, self._m
        assert law is not None
        mode = MODES[self._drive.mode]

        def paid_out(context: Context) -> Array:
            return np.asarray(self.state(context)[n : n + m] - self._home)

        def torques(context: Context, row: int) -> Array:
            out = np.empty((2, m))
            drums = self.GetOutputPort("drum_tensions").Eval(context)
            command, (_, brakes) = self._inputs(context)
            winch_torques(
                np.ascontiguousarray(self.state(context)[n:]), drums, command, brakes, self._home,
                mode, self._arrays.winch, out,
            )  # fmt: skip
            return out[row]

        def speeds(context: Context) -> Array:
            per_angle, _ = law.drum.turning(paid_out(context))
            return np.asarray(self.state(context)[n + m : n + 2 * m] / per_angle)

        first = list(law.leaders or range(m))
        self._vector("motor_angles", m, lambda c: law.drum.motor_angles(paid_out(c))[first], here)
        self._vector("motor_speeds", m, speeds, here)
        needs = {*here, self.all_input_ports_ticket()}
        self._vector("applied_torques", m, lambda context: torques(context, 0), needs)
        self._vector("friction_torques", m, lambda context: torques(context, 1), needs)

    def _vector(
        self, name: str, size: int, value: Callable[[Context], Array], needs: set[DependencyTicket]
    ) -> None:
        def calc(context: Context, output: BasicVector) -> None:
            output.SetFromVector(value(context))

        self.DeclareVectorOutputPort(name, size, calc, needs)

    def DoGetWitnessFunctions(self, context: Context) -> list[WitnessFunction]:
        """One that never triggers: Drake evaluates it where a step begins, after all updates."""
        return [self._witness]

    def _see_begin(self, context: Context) -> float:
        self._begun(context)
        return 1.0

    def _calc_begun(self, context: Context, value: AbstractValue) -> None:
        """Command and wrench where the step begins, shape (m + 6,)."""
        begun: Array = value.get_mutable_value()
        begun[: self._m] = self._command.Eval(context)[self._of_cable]
        if self._wrench.HasValue(context):
            begun[self._m :] = self._wrench.Eval(context)

    def _inputs(self, context: Context) -> tuple[Array, Array]:
        """Command at the time of the context, shape (m,), its rate and the brakes, (2, m)."""
        command, others = self._command.Eval(context), self._calm
        if not self._plain:
            command, others = command[self._of_cable], np.zeros((2, self._m))
            if self._brakes is not None:
                others[1] = self._brakes.Eval(context)[self._of_cable]
        if self._rates is not None and self._rates.HasValue(context):
            others = np.stack([self._rates.Eval(context)[self._of_cable], others[1]])
        else:
            begun = self._begun(context)[: self._m]
            if not np.array_equal(begun, command):
                others = np.stack([self._change(context, begun, command), others[1]])
        if self._may_fail:
            command = self._fail(context, command, others)
        return command, others

    def _change(self, context: Context, begun: Array, command: Array) -> Array:
        """Rates of a command that is another one at the end of a step than where it began."""
        start, time = context.get_discrete_state_vector().value()[self._size], context.get_time()
        if self._held or time <= start:
            return self._still
        return np.asarray((command - begun) / (time - start))

    def _check_held(self, context: Context) -> None:
        """Checks that command and wrench did not change in the step that ends now."""
        start, time = context.get_discrete_state_vector().value()[self._size], context.get_time()
        if time <= start:
            return
        begun, ports = self._begun(context), []
        if self._rates is None or not self._rates.HasValue(context):
            command = self._command.Eval(context)[self._of_cable]
            ports += [] if np.array_equal(command, begun[: self._m]) else [self._command]
        if self._wrench.HasValue(context):
            wrench = self._wrench.Eval(context)
            ports += [] if np.array_equal(wrench, begun[self._m :]) else [self._wrench]
        for port in ports:
            raise CdprError(
                f"{port.get_name()} of {self._robot.name}: found a value that changes between "
                f"{start:g} s and {time:g} s, where nothing samples it; accepted: one that is held "
                "from event to event, or a command_period [s]"
            )

    def _pushed(self, context: Context) -> Array | None:
        """The applied wrench, mean of a step's beginning and its end; None where there is none."""
        if not self._wrench.HasValue(context):
            return None
        wrench: Array = self._wrench.Eval(context)
        begun = self._begun(context)[self._m :]
        return wrench if np.array_equal(begun, wrench) else 0.5 * (begun + wrench)

    def _fail(self, context: Context, command: Array, others: Array) -> Array:
        """Has what failed act: on cables, winches and their brakes; returns their command."""
        flags = {BROKEN: self._still, JAMMED: self._still, POWERLESS: self._still}
        for name, port in self._faults.items():
            if port.HasValue(context):
                found = port.Eval(context)
                flags[name] = found if name == BROKEN else found[self._of_cable]
        break_cables(self._whole, flags[BROKEN], self._arrays.cables)
        if self._drive.kind == MOTORS:
            others[1] = fail_winches(
                self._whole_winch, others[1], flags[JAMMED], flags[POWERLESS], self._arrays.winch
            )
            return command
        others[0] = np.where(flags[JAMMED] != 0.0, 0.0, others[0])
        return np.where(flags[JAMMED] != 0.0, 0.0, command)

    def _calc_reached(self, context: Context, output: BasicVector) -> None:
        """Moves on from the last event, unless that was done already.

        The state of a time does not depend on the inputs of that same time, which a controller may
        have changed by now: what was reached stays.
        """
        memory = output.get_mutable_value()
        # Writable: for one that is not, all of the engine would be compiled again.
        begin, time = context.get_discrete_state_vector().value().copy(), context.get_time()
        command, others = self._still, self._calm
        if time != begin[self._size]:  # else they may follow from the state at once
            command, others = self._inputs(context)
            apply_wrench(self._arrays, self._joint, self._pushed(context))
        packed = self._packed
        bad = packed.reach(self._where, packed.numbers, begin, command, others, time, memory)
        if bad == BACKWARD:
            raise RuntimeError(
                f"the robot's state is that of {begin[self._size]:g} s, but the context stands at "
                f"{time:g} s; set the time first, and then hang the robot"
            )
        if bad != INTEGRATION_OK:
            raise self._problem(bad, memory[self._own], time)

    def _problem(self, bad: int, state: Array, time: float) -> Exception:
        return motion_problem(self._robot, self._set, self.rule, bad, state, time=time)

    def _calc_cables(self, context: Context, value: AbstractValue) -> None:
        table: Array = value.get_mutable_value()
        if self._may_fail:
            self._inputs(context)
        state, n, m = self.state(context), self._n, self._m
        motors = self._drive.kind == MOTORS
        rates = state[n + m : n + 2 * m] if motors else self._ideal_rates(context)
        put_crept(state[self._size - self._arrays.kinds[CREEPING] :], guesses_of(self._room, m))
        bad = self._outputs(
            state[:n], state[n : n + m], rates, self._arrays.cables, self._room, table
        )
        if bad >= 0:
            raise self._problem(bad, state, context.get_time())

    def _ideal_rates(self, context: Context) -> Array:
        out = np.empty(self._m)
        command, _ = self._inputs(context)
        ideal_rates(self._arrays.winch[0, 0], command, out)
        return out

    def _begin_anew(self, context: Context, discrete_state: DiscreteValues) -> None:
        """Takes the state as that of now where the time was set back, as a plant does.

        A default state becomes that of rest at the pose which was drawn, if one was.
        """
        if self._numbers is not None:
            numbers = self._numbers.Eval(context)
            own = context.get_discrete_state_vector().value()
            drawn = not np.array_equal(numbers, self.default_numbers)
            if drawn and np.array_equal(own, self._begin):
                discrete_state.set_value(self._standing(context, self._drawn(numbers)))
                return
        if context.get_time() < context.get_discrete_state_vector().value()[self._size]:
            state = context.get_discrete_state_vector().value()[: self._size]
            discrete_state.set_value(self._standing(context, state))

    def _drawn(self, numbers: Array) -> Array:
        """State at rest at the pose of random numbers, shape (n,)."""
        assert self._random is not None
        X_WP = self._random.pose(self._joint, self._robot.home.transform(), numbers)
        X_WP, held = equilibrium_start(
            self._robot, self._set, self._model, X_WP, slack=None, at_rest=False
        )
        return self._state_at(X_WP, held.unstrained_lengths, held.drum_tensions)

    def _look(self, context: Context) -> None:
        """Computes what is reached at the end of a step, with the inputs that led there."""
        if self._held:
            self._check_held(context)
        self._reached(context)

    def _take(self, context: Context, discrete_state: DiscreteValues) -> None:
        discrete_state.set_value(self._reached(context)[self._values])

    def state(self, context: Context) -> Array:
        """State of platform and winches now, shape (n,), from this system's own context."""
        memory: Array = self._reached(context)
        return memory[self._own]

    def report(self, context: Context) -> Array:
        """Errors and numbers of steps so far, as `advance_kernel.REPORTED` says, shape (4,)."""
        memory: Array = self._reached(context)
        return memory[self._told]

    def set_state(self, context: Context, state: Array) -> None:
        """Sets the state of platform and winches, shape (n,), in this system's own context."""
        context.SetDiscreteState(self._standing(context, state))

    def _standing(self, context: Context, state: Array) -> Array:
        """The discrete state in which a state of platform and winches is that of now."""
        return np.concatenate([state, [context.get_time()], np.zeros(REPORTED)])

    def hold(self, context: Context, X_WP: RigidTransform, lengths: Array, tensions: Array) -> None:
        """Puts the platform at rest at a pose, with lengths, and motors that hold tensions.

        Args:
            context: This system's own context.
            X_WP: Pose of the platform [m].
            lengths: Unstrained lengths, shape (m,) [m]; not read where tensions are commanded.
            tensions: At the drums, shape (m,) [N].
        """
        self.set_state(context, self._state_at(X_WP, lengths, tensions))

    def _state_at(self, X_WP: RigidTransform, lengths: Array, tensions: Array) -> Array:
        state = resting_state(self._robot, self._drive, X_WP, lengths, tensions, home=self._home)
        crept = crept_at_rest(self._set, X_WP, lengths)[: self._arrays.kinds[CREEPING]]
        return np.concatenate([state, np.zeros(self._arrays.kinds[RUBBING]), crept])

    def energy(self, context: Context) -> float:
        """Kinetic and potential energy of platform and cables [J], see `robot_energy`."""
        if self._may_fail:
            self._inputs(context)
        return self.energy_of(self.state(context))

    def energy_of(self, state: Array) -> float:
        """The same of a state of platform and winches, shape (n,)."""
        return float(robot_energy(self._arrays, np.ascontiguousarray(state, dtype=float)))

    def parts(self) -> list[int]:
        """Sizes of the parts of `MEMORY`: what is past, the state of the platform, the rest."""
        past, total = self._platform.start, self._told.stop + 1 + self._m
        return [past, self._n, total - past - self._n]

    def arrays(self) -> RobotArrays:
        """The robot as the kernels take it; its work space is this block's."""
        return self._arrays

    def cables(self) -> Array:
        """`CableSet.packed` of the cables in the frames of `PlatformJoint`, shape (m, 17)."""
        return self._arrays.cables

    def cable_set(self) -> CableSet:
        """The cables as they are simulated."""
        return self._set

    def model(self) -> str:
        """The model of the cables."""
        return self._model
