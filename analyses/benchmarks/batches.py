"""Benchmarks of many robots at once, beside MuJoCo's rollouts of the same robot's tendons."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator

from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, processor_seconds
from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_exchange import export_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings

ROBOT = "acrobot_small"
PERIOD, STEP = 0.01, 1e-3
"""A step of a batch, and of the methods inside it [s]."""

SETTINGS = CableRobotSettings(cables=CableSettings(model="elastic"))
"""Cables that MuJoCo's tendons can be: straight springs that only pull."""

METHODS = {"RK4": "fourth order, four evaluations", "implicitfast": "first order, one evaluation"}
"""MuJoCo's integrators, and what they do in each of ten steps."""

TURN = 0.5
"""Moment by which each platform is turned, about [N m]: it moves, and some cables go slack."""


def batch_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; MuJoCo's without it are left out."""
    count, ways, repeats = (64, 5, 2) if quick else (1000, 20, 7)
    robot = load_robot(ROBOT)
    moments = np.random.default_rng(0).normal(0.0, TURN, (count, 3))
    wrenches = np.hstack([moments, np.zeros((count, 3))])
    batch = BatchRobots(robot, count, settings=SETTINGS, threads=1)
    both = BatchRobots(robot, count, settings=SETTINGS, threads=2)
    works: dict[str, Callable[[], float]] = {
        "one thread": lambda: _rate(batch, wrenches, ways),
        "two threads": lambda: _rate(both, wrenches, ways),
        "one after the other in Drake's Simulator": lambda: _single_rate(robot, 50 * ways),
    }
    if importlib.util.find_spec("mujoco") is not None:
        for method, words in METHODS.items():
            rolled = TendonRollout(robot, moments, method)
            name = f"MuJoCo's rollout of tendons, {method}: {words}"
            works[name] = lambda r=rolled: r.rate(ways)  # type: ignore[misc]
    rates = dict(zip(works, interleaved(list(works.values()), repeats), strict=True))
    one, two = rates.pop("one thread"), rates.pop("two threads")
    unit, name = "steps of 10 ms per s of processor time", f"batch of {count} robots, one thread"
    rows = [
        TimingRow(name, one, unit, words, other, one / other, ratio_means="times as many steps")
        for words, other in rates.items()
    ]
    return [
        *rows,
        TimingRow(
            f"batch of {count} robots, two threads", two, unit, "one thread", one,
            2.0 * two / one, ratio_means="times as fast where two cores are free",
        ),
    ]  # fmt: skip


def _rate(batch: BatchRobots, wrenches: Array, ways: int) -> float:
    """Steps of robots per second of processor time."""
    batch.reset()
    still = np.zeros((ways, batch.commands_per_robot))
    seconds = processor_seconds(lambda: batch.rollout(still, PERIOD, wrenches=wrenches))
    return ways * batch.count / seconds


def _single_rate(robot: Robot, ways: int) -> float:
    """The same of one compiled robot in a diagram."""
    block = CompiledCableRobot(robot, SETTINGS, rule=StepRule(max_step=STEP), floor=False)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, robot.home.transform())
    block.get_input_port(0).FixValue(context, np.zeros(len(robot.cables)))
    block.GetInputPort("applied_wrench").FixValue(context, [TURN, TURN, TURN, 0.0, 0.0, 0.0])
    simulator.Initialize()

    def advance() -> None:
        for k in range(ways):
            simulator.AdvanceTo((k + 1) * PERIOD)

    return ways / processor_seconds(advance)


class TendonRollout:
    """The robots of a batch by `mujoco.rollout`: the file that `cdpr export` writes, in one thread.

    Lengths stay. Only moments act on the platforms: MuJoCo's forces act at the centre of mass,
    which turns about Po.
    """

    def __init__(self, robot: Robot, moments: Array, method: str, step: float = STEP) -> None:
        """At rest at home, with moments in W, shape (count, 3) [N m].

        Args:
            robot: The robot.
            moments: On the platform of each.
            method: A name of `METHODS`.
            step: Its step [s].
        """
        import mujoco
        from mujoco import rollout

        self._run: Any = rollout.rollout
        (file,) = export_robot(robot, "mjcf").values()
        self._model: Any = mujoco.MjModel.from_xml_string(file)
        self._model.opt.timestep = step
        self._model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{method.upper()}")
        self._data: Any = mujoco.MjData(self._model)
        self._kind: Any = mujoco.mjtState.mjSTATE_XFRC_APPLIED
        full = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self._start = np.empty(mujoco.mj_stateSize(self._model, full))
        mujoco.mj_getState(self._model, self._data, self._start, full)
        # Force and moment on the world, then on the platform.
        push = np.hstack([np.zeros((len(moments), 9)), moments])
        self._pushes, self._step = push[:, None], step

    def roll(self, ways: int) -> Array:
        """States (time, position, quaternion, velocities) at the ends of steps, (count, k, 14)."""
        steps = round(ways * PERIOD / self._step)
        states, _ = self._run(
            self._model, self._data, self._start[None], self._pushes,
            control_spec=int(self._kind), nstep=steps, skip_checks=False,
        )  # fmt: skip
        return np.asarray(states)

    def rate(self, ways: int) -> float:
        """Steps of `PERIOD` per second of processor time."""
        return ways * len(self._pushes) / processor_seconds(lambda: self.roll(ways))
