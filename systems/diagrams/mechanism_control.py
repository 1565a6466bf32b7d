"""Wires a mechanism that follows a wanted motion on its cables into one Diagram."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import QuaternionFloatingJoint
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import ZeroOrderHold

from cdpr_drake.arrays import Array
from cdpr_drake.errors import (
    CableModelError,
    CdprError,
    EquilibriumError,
    InfeasibleTensionError,
    ScenarioError,
    TensionProblemError,
)
from cdpr_drake.geometry.cable_routes import Integers
from cdpr_drake.models.mechanism_in_plant import MechanismInPlant, add_mechanism
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import Rest, hang, rows_of_motors, scoped_joint
from cdpr_drake.models.plant_statics import plant_tension_problem
from cdpr_drake.schema.declarations import Refusal, Scope
from cdpr_drake.systems.controllers.plant_following import (
    LengthFollower,
    MotorFollower,
    WantedPlantMotion,
)
from cdpr_drake.systems.controllers.plant_tracking import PlantTensionDistributor, PlantTracking
from cdpr_drake.systems.monitoring.log_row import RunLog, add_log
from cdpr_drake.systems.robots.assembly import apply_force
from cdpr_drake.systems.robots.compiled_mechanism import CompiledMechanism
from cdpr_drake.systems.robots.route_assembly import CablePorts, add_cables
from cdpr_drake.systems.robots.settings import COMPILED, CableSettings
from cdpr_drake.systems.robots.tension_driven_routes import TensionDrivenRoutes
from cdpr_drake.systems.scenarios.mechanism_motion import moving_joints, plant_motion
from cdpr_drake.systems.scenarios.mechanism_scenario import (
    COMPUTED_TORQUE,
    USUAL_METHOD,
    MechanismScenario,
)
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.problem import TensionStatus
from cdpr_drake.trajectories.plant_motion import PlantMotion


@dataclass(frozen=True, eq=False)
class MechanismFollower:
    """A mechanism that follows a wanted motion.

    Attributes:
        scenario: The scenario.
        mechanism: The mechanism.
        plant: Its plant; by compiled steps it stands outside of the diagram.
        cables: The cables as they are simulated.
        motion: The wanted motion.
        diagram: The diagram.
        log: What the run stores.
        rest: Where it starts at rest on winches; None where tensions are commanded.
        ports: Cables and winches beside the plant; None where there are none.
        engine: What moves it in compiled steps; None where the plant moves.
    """

    scenario: MechanismScenario
    mechanism: Mechanism
    plant: MultibodyPlant
    cables: PlantCables
    motion: PlantMotion
    diagram: Diagram
    log: RunLog
    rest: Rest | None
    ports: CablePorts | None
    engine: CompiledMechanism | None

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest tension that are asked for [N]."""
        return self.scenario.limits(self.mechanism)

    def motors(self) -> Integers:
        """Rows that motors act on, shape (k,)."""
        return np.flatnonzero(rows_of_motors(self.plant))

    def make_context(self) -> Context:
        """A root context at rest where the motion begins."""
        context = self.diagram.CreateDefaultContext()
        if self.engine is not None and self.rest is not None:
            self.engine.put(self.engine.GetMyMutableContextFromRoot(context), self.rest)
        elif self.ports is not None and self.rest is not None:
            self.ports.put(context, self.rest)
        else:
            own = self.plant.GetMyMutableContextFromRoot(context)
            self.plant.SetPositions(own, self.motion.positions[0])
        return context

    def state(self, context: Context) -> Array:
        """Positions and velocities, shape (nq + nv,), from a root context."""
        if self.engine is not None:
            own = self.engine.GetMyContextFromRoot(context)
            return np.array(self.engine.GetOutputPort("plant_state").Eval(own))
        return np.array(
            self.plant.GetPositionsAndVelocities(self.plant.GetMyContextFromRoot(context))
        )

    def way_off(self, q: Array, wanted: Array) -> Array:
        """Way from positions to wanted ones, as velocities for one second, shape (nv,)."""
        goal = np.array(wanted)
        for start, _ in self.motion.quaternions:
            part = slice(start, start + 4)
            goal[part] *= 1.0 if goal[part] @ q[part] >= 0.0 else -1.0
        self.plant.SetPositions(self._own, q)
        return np.asarray(self.plant.MapQDotToVelocity(self._own, goal - q))

    @cached_property
    def _own(self) -> Context:
        """A context of the plant for questions."""
        return self.plant.CreateDefaultContext()

    def turns(self) -> np.ndarray:
        """Which velocities are rates of angles, shape (nv,), true or false."""
        found = np.zeros(self.plant.num_velocities(), dtype=bool)
        for joint in moving_joints(self.plant):
            for k in range(joint.num_velocities()):
                found[joint.velocity_start() + k] = joint.velocity_suffix(k).startswith("w")
        return found

    def parts(self) -> dict[str, tuple[list[int], list[int]]]:
        """Of each joint, and of each free body by its name, the velocities that move, and those
        that turn."""
        found, turns = {}, self.turns()
        for joint in moving_joints(self.plant):
            rows = joint.velocity_start() + np.arange(joint.num_velocities())
            both = rows[~turns[rows]].tolist(), rows[turns[rows]].tolist()
            found[part_name(self.plant, joint)] = both
        return found

    def velocity_names(self) -> list[str]:
        """A name for each velocity: the joint's, or free body's, and which of its rates."""
        found = [""] * self.plant.num_velocities()
        for joint in moving_joints(self.plant):  # a free body's comes last, its velocities first
            name, n = part_name(self.plant, joint), joint.num_velocities()
            for k in range(n):
                words = name if n == 1 else f"{name}.{joint.velocity_suffix(k)}"
                found[joint.velocity_start() + k] = words
        return found

    def position_names(self) -> list[str]:
        """A name for each position, with its unit, if it has one."""
        found = [""] * self.plant.num_positions()
        for joint in moving_joints(self.plant):
            name, n = part_name(self.plant, joint), joint.num_positions()
            free = isinstance(joint, QuaternionFloatingJoint)
            for k in range(n):
                suffix = joint.position_suffix(k)
                unit = "" if free and k < 4 else "_rad" if suffix.startswith("q") else "_m"
                words = name if n == 1 else f"{name}.{suffix}"
                found[joint.position_start() + k] = words + unit
        return found

    def part_errors(self, off: Array) -> dict[str, tuple[Array, Array]]:
        """Distance [m] and angle [rad] of each joint or free body from where it should be.

        Args:
            off: As `way_off` gives it, one or many, shape (..., nv).
        """
        return {
            name: (
                np.linalg.norm(off[..., moves], axis=-1), np.linalg.norm(off[..., turns], axis=-1)
            )
            for name, (moves, turns) in self.parts().items()
        }  # fmt: skip

    def largest_error(self, q: Array, time: float) -> tuple[float, float]:
        """Largest distance [m] and angle [rad] of a joint or free body at a time [s]."""
        errors = self.part_errors(self.way_off(q, self.motion.at(time)[0])).values()
        return float(max(e[0] for e in errors)), float(max(e[1] for e in errors))

    def errors(self, context: Context) -> tuple[float, float]:
        """`largest_error` in a root context."""
        q = self.state(context)[: self.plant.num_positions()]
        return self.largest_error(q, context.get_time())

    def read_log(self, context: Context) -> dict[str, Array]:
        """What was logged, from a root context.

        "time" (n,) [s]; "positions" and "wanted_positions" (n, nq), "velocities" and
        "wanted_velocities" (n, nv), "way_off" (n, nv) [rad, m]; "tensions" [N], "lengths" [m],
        "slack" (n, m); on winches "unstrained_lengths" (n, m) [m], else "feasible" and "failures"
        (n, 1); where there are motors "motor_forces" (n, k) [N, N m].
        """
        log = self.log.read(context)
        nq, motors = self.plant.num_positions(), self.motors()
        states, forces = log.pop("plant_state"), log.pop("motor_force", None)
        wanted = [self.motion.at(float(t)) for t in log["time"]]
        q, q_d = states[:, :nq], np.array([each[0] for each in wanted]).reshape(-1, nq)
        found = {
            "time": log.pop("time"),
            "positions": q,
            "wanted_positions": q_d,
            "velocities": states[:, nq:],
            "wanted_velocities": np.array([each[1] for each in wanted]),
            "way_off": np.array([self.way_off(*pair) for pair in zip(q, q_d, strict=True)]),
            **log,
        }
        return found if forces is None else found | {"motor_forces": forces[:, motors]}


def part_name(plant: MultibodyPlant, joint: object) -> str:
    """Scoped name of a joint, or of the free body that it is the joint of."""
    if isinstance(joint, QuaternionFloatingJoint):
        return str(joint.child_body().scoped_name().get_full())
    return scoped_joint(plant, joint)


def build_mechanism_follower(
    scenario: MechanismScenario, mechanism: Mechanism | None = None
) -> MechanismFollower:
    """Builds the diagram of a scenario.

    Args:
        scenario: The scenario, checked.
        mechanism: Its mechanism; None: it is loaded.

    Raises:
        ScenarioError: A waypoint that the plant cannot have, or what cannot be built; names the
            key.
        CdprError: The mechanism is not accepted.
    """
    mechanism = mechanism or load_mechanism(scenario.mechanism)
    if scenario.control.kind == COMPUTED_TORQUE:
        return _by_tensions(scenario, mechanism)
    return _by_winches(scenario, mechanism)


def _by_tensions(scenario: MechanismScenario, mechanism: Mechanism) -> MechanismFollower:
    builder, plant = DiagramBuilder(), MultibodyPlant(0.0)
    builder.AddNamedSystem("plant", plant)
    added, control = _finalized(plant, mechanism), scenario.control
    routes = added.routes() if scenario.cables.pulleys else added.routes().without_pulleys()
    cables = PlantCables(plant, routes)
    motion = plant_motion(plant, added.home_positions(), scenario.motion.waypoints)
    m, prestress = routes.count, control.prestress
    wanted = builder.AddNamedSystem("wanted", WantedPlantMotion(plant, motion))
    law = builder.AddNamedSystem("tracking", PlantTracking(plant, control.kp, control.kd))
    try:
        share = PlantTensionDistributor(
            cables, scenario.limits(mechanism), control.method, control.rate,
            reference=None if prestress is None else np.full(m, prestress),
        )  # fmt: skip
    except TensionProblemError as problem:
        raise ScenarioError(f"control.method: {problem}") from problem
    builder.AddNamedSystem("distributor", share)
    pull = builder.AddNamedSystem("cables", TensionDrivenRoutes(plant, routes))
    state = plant.get_state_output_port()
    for block in (law, share, pull):
        builder.Connect(state, block.GetInputPort("plant_state"))
    for port in ("desired_state", "desired_acceleration"):
        builder.Connect(wanted.GetOutputPort(port), law.GetInputPort(port))
    builder.Connect(law.GetOutputPort("desired_force"), share.GetInputPort("desired_force"))
    builder.Connect(share.GetOutputPort("tensions"), pull.GetInputPort("tensions"))
    apply_force(builder, plant, pull.GetOutputPort("generalized_force"))
    logged = {"plant_state": state}
    for block, names in (
        (share, ("tensions", "feasible", "failures")), (pull, ("lengths", "slack"))
    ):  # fmt: skip
        logged |= {name: block.GetOutputPort(name) for name in names}
    if np.any(rows_of_motors(plant)):
        apply_force(builder, plant, share.GetOutputPort("motor_force"), name="motors")
        logged["motor_force"] = share.GetOutputPort("motor_force")
    log = add_log(builder, logged, scenario.log_rate)
    return MechanismFollower(
        scenario, mechanism, plant, cables, motion, _built(builder, mechanism), log, None, None,
        None,
    )  # fmt: skip


def _by_winches(scenario: MechanismScenario, mechanism: Mechanism) -> MechanismFollower:
    builder, plant = DiagramBuilder(), MultibodyPlant(0.0)
    compiled, control = scenario.integration.engine == COMPILED, scenario.control
    if not compiled:
        builder.AddNamedSystem("plant", plant)
    added = _finalized(plant, mechanism)
    settings: CableSettings = scenario.cables
    given = added.routes()
    routes = given.with_cables(settings.applied(given.ends))
    cables = PlantCables(plant, routes, settings.model_of())
    low, high = scenario.limits(mechanism)
    try:
        rest = hang(
            cables,
            plant.CreateDefaultContext(),
            prestress=control.prestress,
            lower=low if low > 0.0 else None,
            upper=high,
        )
    except CableModelError as problem:
        raise ScenarioError(f"cables.model: {problem}") from problem
    except (InfeasibleTensionError, EquilibriumError) as problem:
        raise ScenarioError(f"control: at the start, {problem}") from problem
    motion = plant_motion(plant, rest.positions, scenario.motion.waypoints)
    period, engine, ports = 1.0 / control.rate, None, None
    if compiled:
        engine = CompiledMechanism(
            plant, routes, settings.model_of(), period=period,
            max_step=scenario.integration.max_step,
        )  # fmt: skip
        block: CompiledMechanism | CablePorts = builder.AddNamedSystem("mechanism", engine)
    else:
        block = ports = add_cables(builder, plant, given, settings)
    follower = builder.AddNamedSystem("lengths", LengthFollower(cables, motion, rest, control.rate))
    velocities: OutputPort = follower.GetOutputPort("cable_velocities")
    if not compiled:  # the engine compiled holds what it samples
        velocities = _held(builder, velocities, period, "held_velocities")
    builder.Connect(velocities, block.GetInputPort("cable_velocities"))
    state = block.GetOutputPort("plant_state")
    logged = {"plant_state": state}
    if np.any(rows_of_motors(plant)):
        forces = _add_motors(builder, scenario, cables, motion, rest.tensions, state)
        if engine is not None:
            builder.Connect(forces, engine.GetInputPort("joint_forces"))
        else:
            forces = _held(builder, forces, period, "held_forces")
            apply_force(builder, plant, forces, name="motors")
        logged["motor_force"] = forces
    for name in ("tensions", "lengths", "slack", "unstrained_lengths"):
        logged[name] = block.GetOutputPort(name)
    log = add_log(builder, logged, scenario.log_rate)
    return MechanismFollower(
        scenario, mechanism, plant, cables, motion, _built(builder, mechanism), log, rest, ports,
        engine,
    )  # fmt: skip


def _add_motors(
    builder: DiagramBuilder, scenario: MechanismScenario, cables: PlantCables, motion: PlantMotion,
    tensions: Array, state: OutputPort,
) -> OutputPort:  # fmt: skip
    """What the motors of joints do, not yet held from step to step."""
    plant, control = cables.plant, scenario.control
    wanted = builder.AddNamedSystem("wanted", WantedPlantMotion(plant, motion))
    law = builder.AddNamedSystem("tracking", PlantTracking(plant, control.kp, control.kd))
    motors = builder.AddNamedSystem("motors", MotorFollower(cables, tensions))
    builder.Connect(state, law.GetInputPort("plant_state"))
    for port in ("desired_state", "desired_acceleration"):
        builder.Connect(wanted.GetOutputPort(port), law.GetInputPort(port))
    builder.Connect(wanted.GetOutputPort("desired_state"), motors.GetInputPort("desired_state"))
    builder.Connect(law.GetOutputPort("desired_force"), motors.GetInputPort("desired_force"))
    return motors.GetOutputPort("motor_force")


def _held(builder: DiagramBuilder, port: OutputPort, period: float, name: str) -> OutputPort:
    hold = builder.AddNamedSystem(name, ZeroOrderHold(period, port.size()))
    builder.Connect(port, hold.get_input_port())
    return hold.get_output_port()


def _finalized(plant: MultibodyPlant, mechanism: Mechanism) -> MechanismInPlant:
    added = add_mechanism(plant, mechanism)
    added.finalize()
    return added


def _built(builder: DiagramBuilder, mechanism: Mechanism) -> Diagram:
    diagram = builder.Build()
    diagram.set_name(f"{mechanism.name}_follower")
    return diagram


def mechanism_refusals(scope: Scope) -> Iterator[Refusal]:
    """Waypoints that the mechanism cannot have or hold, or cables that cannot be simulated so."""
    if any(scope.whole.refusals(scope)):
        return
    try:
        follower = build_mechanism_follower(scope.whole, scope.robot)
    except ScenarioError as problem:
        raise ScenarioError(*(f"{scope.path}: {line}" for line in problem.problems)) from problem
    except CdprError as problem:
        raise ScenarioError(f"{scope.path}: {problem}") from problem
    for k, words in _not_held(follower):
        yield "home" if not k else f"motion.waypoints[{k - 1}]", words, ""


def _not_held(follower: MechanismFollower) -> Iterator[tuple[int, str]]:
    """Waypoints at which no tensions hold the mechanism where computed torque asks for them."""
    if follower.rest is not None:
        return
    context = follower.plant.CreateDefaultContext()
    low, high = follower.limits
    for k, q in enumerate(follower.motion.positions):
        follower.plant.SetPositions(context, q)
        try:
            problem = plant_tension_problem(follower.cables, context, limits=follower.limits)
            if distribute(problem, USUAL_METHOD).status != TensionStatus.FEASIBLE:
                bounds = f"within {low:g}..{high:g} N"
                found = f"found positions where no tensions {bounds} hold the mechanism"
                yield k, f"{found}; accepted: positions that can be held"
        except CdprError as problem_there:
            yield k, str(problem_there)
