"""Dynamic control at 1 kHz against MuJoCo with daqp, and many robots against MuJoCo's rollouts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.runs.engine import fixed_step_simulator
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.arrays import Array
from cdpr_drake.formats.robot_exchange import export_robot
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_motion import HELD
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import COMPILED, PLANT, CableRobotSettings, CableSettings
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE, write_motion
from tests.benchmarks.ratios import Ratio, per_call, ratios
from tests.benchmarks.solvers import DaqpLoop

SCENARIO, ROBOT = "caroca_computed_torque", "acrobot_small"
"""The scenario of the loops, and the robot of the rollouts."""

LOG_STEPS = 10
"""Control steps from row to row of the log."""

PERIOD, STEP = 0.01, 1e-3
"""A step of a batch, and of the integrators inside it [s]."""

COUNT, WAYS = 1000, 20
"""Robots of a batch, and their steps of `PERIOD`."""

TURN = 0.5
"""Moments on the platforms are about this; they move, and some cables become slack [N m]."""

ELASTIC = CableRobotSettings(cables=CableSettings(model="elastic"))
"""Cables that MuJoCo's tendons can be: straight springs that only pull."""

INTEGRATORS = {"RK4": "four evaluations a step", "implicitfast": "one evaluation a step"}


def benchmark() -> Iterator[Ratio]:
    """A simulated second of the loops, then a step of 10 ms of one of 1000 robots."""
    yield from ratios(dynamic_ways())
    yield from batch_ratios()


def dynamic_ways() -> dict[str, Callable[[], float]]:
    """Computed torque, exact tensions, motion and log, on the same robot and trajectory."""
    compiled = compiled_loop()
    ways: dict[str, Callable[[], object]] = {
        "dynamic loop, compiled": lambda: compiled.advance_to(compiled.time + 1.0)
    }
    for engine in (COMPILED, PLANT):
        scenario = dynamic_scenario(engine)
        built, rule = TensionRun(scenario).built, scenario.integration
        simulator = fixed_step_simulator(
            built.diagram, built.make_context(), rule.integrator, rule.max_step
        )
        simulator.Initialize()
        ways[f"dynamic loop in a diagram, {engine} engine"] = partial(_advance, simulator)
    tendons = TendonLoop(dynamic_scenario(PLANT))
    ways["the same loop by MuJoCo and daqp"] = lambda: tendons.advance(1000)
    return {name: per_call(way) for name, way in ways.items()}


def _advance(simulator: Simulator) -> None:
    """Advances a simulator by a second."""
    simulator.AdvanceTo(simulator.get_context().get_time() + 1.0)


def dynamic_scenario(engine: str) -> TensionScenario:
    """The scenario by an engine, without damping of the platform, as in MuJoCo's model."""
    undamped = "damping={translation: 0, rotation: 0}"
    scenario = load_scenario(SCENARIO, [f"integration.engine={engine}", undamped])
    assert isinstance(scenario, TensionScenario)
    return scenario


def compiled_loop() -> TensionLoop:
    """The compiled loop of the scenario at the start of its trajectory."""
    scenario = dynamic_scenario(COMPILED)
    return TensionLoop(TensionRun(scenario).built, scenario.log_rate)


def tendon_model(robot: Robot, step: float) -> Any:
    """A robot as a MuJoCo model: a free body, a spatial tendon and a motor on it for each cable.

    Cables run from fixed exit points. MuJoCo's integrator is its default one, which evaluates the
    forces once a step.

    Args:
        robot: A robot that is not planar.
        step: Step of the integrator [s].
    """

    def words(values: Any) -> str:
        return " ".join(repr(float(value)) for value in values)

    inertia = platform_inertia(robot)
    com = inertia.get_com()
    G = inertia.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()
    moments = [G[0, 0], G[1, 1], G[2, 2], G[0, 1], G[0, 2], G[1, 2]]
    ends = list(enumerate(robot.cables))
    exits = "".join(f'<site name="A{i}" pos="{words(c.exit_point)}"/>' for i, c in ends)
    anchors = "".join(f'<site name="B{i}" pos="{words(c.anchor_point)}"/>' for i, c in ends)
    tendons = "".join(
        f'<spatial name="T{i}"><site site="A{i}"/><site site="B{i}"/></spatial>' for i, _ in ends
    )
    motors = "".join(f'<motor tendon="T{i}" gear="-1"/>' for i, _ in ends)
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" gravity="0 0 {-robot.gravity}"/>'
        f'<worldbody>{exits}<body name="P"><freejoint/>'
        f'<inertial pos="{words(com)}" mass="{inertia.get_mass()}" '
        f'fullinertia="{words(moments)}"/>{anchors}</body></worldbody>'
        f"<tendon>{tendons}</tendon><actuator>{motors}</actuator></mujoco>"
    )


class TendonLoop:
    """Computed torque along a scenario's trajectory: MuJoCo moves the robot, daqp finds tensions.

    MuJoCo gives the tendons' Jacobian, the mass matrix and the bias, so that the loop in Python has
    little to do; the desired motion is this project's compiled one. MuJoCo is called as its
    documentation writes control loops.
    """

    def __init__(self, scenario: TensionScenario) -> None:
        """At rest at the start of the trajectory."""
        robot, control = load_robot(scenario.robot), scenario.controller
        self._model = tendon_model(robot, 1.0 / control.rate)
        self._data: Any = mujoco.MjData(self._model)
        self._gains = control.stiffness, control.damping
        trajectory = scenario.trajectory.trajectory()
        self._stretches = trajectory.stretches()
        start = trajectory.pose(0.0)
        self._data.qpos[:3] = start.translation()
        self._data.qpos[3:] = start.rotation().ToQuaternion().wxyz()
        cables = scenario.believed_cables(robot)
        problem = tension_problem(robot, start, limits=scenario.limits(), cables=cables)
        self._tensions = DaqpLoop(problem)
        self._shape = problem.W.shape[::-1]
        self._rows: list[tuple[float, Array, Array]] = []

    @property
    def time(self) -> float:
        """Time that is reached [s]."""
        return float(self._data.time)

    def pose(self) -> Array:
        """Position [m] and quaternion wxyz of the platform, shape (7,)."""
        return np.array(self._data.qpos)

    def tensions(self) -> Array:
        """Tensions of the last step, shape (m,) [N]."""
        return np.array(self._data.ctrl)

    def advance(self, steps: int) -> None:
        """Goes on by some control steps."""
        model, data = self._model, self._data
        Kp, Kd = self._gains
        qpos, qvel, ctrl, bias = data.qpos, data.qvel, data.ctrl, data.qfrc_bias
        R = data.body("P").xmat.reshape(3, 3)
        J = data.ten_J.reshape(self._shape)
        desired, turn = np.empty(MOTION_SIZE), np.empty(3)
        acceleration, force = np.empty(6), np.empty(6)
        for step in range(steps):
            if step % LOG_STEPS == 0:
                self._rows.append((data.time, qpos.copy(), ctrl.copy()))
            mujoco.mj_step1(model, data)
            write_motion(data.time, self._stretches, desired)
            mujoco.mju_subQuat(turn, desired[:4], qpos[3:])
            acceleration[:3] = (
                desired[16:] + Kp * (desired[4:7] - qpos[:3]) + Kd * (desired[10:13] - qvel[:3])
            )
            acceleration[3:] = (desired[13:16] + Kd * desired[7:10]) @ R + Kp * turn - Kd * qvel[3:]
            mujoco.mj_mulM(model, data, force, acceleration)
            force += bias
            tensions, _, flag, _ = self._tensions.solve(np.ascontiguousarray(-J.T), -force)
            if flag > 0:
                ctrl[:] = tensions
            mujoco.mj_step2(model, data)


def batch_ratios() -> Iterator[Ratio]:
    """Processor time of one robot for `PERIOD`, robots being pushed and cables halted."""
    robot = load_robot(ROBOT)
    moments = np.random.default_rng(0).normal(0.0, TURN, (COUNT, 3))
    wrenches = np.hstack([moments, np.zeros((COUNT, 3))])

    def batch(threads: int) -> Callable[[], float]:
        robots = BatchRobots(robot, COUNT, settings=ELASTIC, threads=threads)
        still = np.zeros((WAYS, robots.commands_per_robot))

        def work() -> None:
            robots.reset()
            robots.rollout(still, PERIOD, wrenches=wrenches)

        return per_call(work, parts=WAYS * COUNT)

    tendons = {
        f"MuJoCo's rollout, {method}, {words}": per_call(
            partial(TendonRollout(robot, moments, method).roll, WAYS), parts=WAYS * COUNT
        )
        for method, words in INTEGRATORS.items()
    }
    yield from ratios({
        "compiled robot in Drake's Simulator": per_call(_single(robot, 1000), parts=1000),
        **tendons,
        f"batch of {COUNT} robots, two threads": batch(2),
        "the batch, one thread": batch(1),
    }, 7)  # fmt: skip


def _single(robot: Robot, steps: int) -> Callable[[], None]:
    """The same of one compiled robot in a diagram, from its equilibrium on."""
    rule = StepRule(max_step=STEP)
    block = CompiledCableRobot(robot, ELASTIC, rule=rule, floor=False, command_period=HELD)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, robot.home.transform())
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    block.GetInputPort("applied_wrench").FixValue(context, [TURN, TURN, TURN, 0.0, 0.0, 0.0])

    def work() -> None:
        start = context.get_time()
        for k in range(steps):
            simulator.AdvanceTo(start + (k + 1) * PERIOD)

    return work


class TendonRollout:
    """The robots of a batch by `mujoco.rollout`: the file that `cdpr export` writes, in one thread.

    Lengths stay. Only moments act on the platforms: MuJoCo's forces act at the centre of mass,
    which turns about Po.
    """

    def __init__(self, robot: Robot, moments: Array, method: str, step: float = STEP) -> None:
        """At rest at home.

        Args:
            robot: The robot.
            moments: Moments in W on each platform, shape (count, 3) [N m].
            method: MuJoCo's integrator.
            step: Its step [s].
        """
        (file,) = export_robot(robot, "mjcf").values()
        self._model: Any = mujoco.MjModel.from_xml_string(file)
        self._model.opt.timestep = step
        self._model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{method.upper()}")
        self._data: Any = mujoco.MjData(self._model)
        full = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self._start = np.empty(mujoco.mj_stateSize(self._model, full))
        mujoco.mj_getState(self._model, self._data, self._start, full)
        # Force and moment on the world, then on the platform.
        push = np.hstack([np.zeros((len(moments), 9)), moments])
        self._pushes, self._step = push[:, np.newaxis], step

    def roll(self, ways: int) -> Array:
        """States (time, position, quaternion, velocities) at the ends of steps, (count, k, 14)."""
        states, _ = rollout.rollout(
            self._model, self._data, self._start[np.newaxis], self._pushes,
            control_spec=int(mujoco.mjtState.mjSTATE_XFRC_APPLIED),
            nstep=round(ways * PERIOD / self._step), skip_checks=False,
        )  # fmt: skip
        return np.asarray(states)
