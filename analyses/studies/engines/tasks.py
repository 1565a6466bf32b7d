"""What the study runs, as tasks of a sweep; each item is a pair of runs or a row of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.engines.pairs import (
    commanded_path,
    run_pair,
    state_distance,
)
from cdpr_drake.arrays import Array
from cdpr_drake.geometry import cable_paths
from cdpr_drake.models import Robot, load_robot
from cdpr_drake.systems.robots import (
    SEMI_IMPLICIT,
    CableRobot,
    CableRobotSettings,
    CableSettings,
    CompiledCableRobot,
    StepRule,
    automatic_step,
)

IMPACTS = "acrobot_pbvs"
"""The servo whose cables are paid out at random at its start, so that they catch on the way."""

MOST_SLACK = 5e-3
"""Largest length that is paid out [m]."""

DRAWN = ("acrobot_small", "acrobot_large", "planar")
"""Robots whose cables, points and masses are varied."""

TAUT_DURATION, TAUT_PERIOD = 10.0, 0.02
"""Of a taut motion, and of a command in it [s]."""

AMPLITUDE = 0.02
"""Of a taut motion [m]."""

SOFTER = 1e3
"""Times softer than ACROBOT's are the cables on which orders are measured: real ones vibrate within
half a millisecond, and what is slower than a step cannot be told from it."""

DROP_DURATION = 0.4
"""Of the motions on which orders are measured [s]."""

DROP_STEPS = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4)
"""Steps of them [s]."""

REFERENCE_STEP = 2e-5
"""Step of the plant to which they are compared [s]."""

EXPLICIT = "runge_kutta3"
METHODS = ("runge_kutta2", EXPLICIT, SEMI_IMPLICIT)

ENERGY_DURATION = 5.0
"""How long an undamped robot bounces on its real cables [s]."""

ENERGY_STEPS = (1e-4, 5e-5, 2.5e-5)
"""Steps of that [s]; the largest stable one with all cables taut is about 1e-3."""

ENERGY_SLACK = 5e-4
"""Length paid out on all cables at its start: it falls into them [m]."""


@dataclass(frozen=True)
class ScenarioTask:
    """A shipped scenario by both engines; one item."""

    name: str
    overrides: tuple[str, ...] = ()

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """`COLUMNS` of the pairs, shape (n, len(COLUMNS))."""
        return {
            "pairs": np.array([run_pair(self.name, self.overrides) for _ in range(start, stop)])
        }


@dataclass(frozen=True)
class StepTask:
    """A servo with impacts by both engines at one step after the other."""

    steps: tuple[float, ...]
    duration: float

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """`COLUMNS` of the pairs, shape (n, len(COLUMNS))."""
        slack = slack_override(0)
        times = (f"duration={self.duration}", f"stop.hold={self.duration}")
        return {
            "pairs": np.array([
                run_pair(IMPACTS, [slack, *times, f"integration.max_step={step}"])
                for step in self.steps[start:stop]
            ])
        }  # fmt: skip


@dataclass(frozen=True)
class ImpactTask:
    """The servo with cables paid out at random; the item is the seed."""

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """`COLUMNS` of the pairs, shape (n, len(COLUMNS))."""
        return {
            "pairs": np.array([
                run_pair(IMPACTS, [slack_override(seed), f"seed={seed}"])
                for seed in range(start, stop)
            ])
        }  # fmt: skip


def slack_override(seed: int) -> str:
    """Lengths that are paid out at the start, by a seed, as an override of a scenario."""
    slack = np.random.default_rng(seed).uniform(0.0, MOST_SLACK, 8)
    return f"perturbations.slack=[{', '.join(f'{x:.6f}' for x in slack)}]"


def drawn_robot(seed: int) -> tuple[Robot, CableRobotSettings]:
    """A robot with other masses, cables and exit points, and whether it has pulleys."""
    random = np.random.default_rng(seed)
    robot = load_robot(DRAWN[random.integers(len(DRAWN))])
    robot.cable.youngs_modulus *= 10.0 ** random.uniform(-3.0, 0.0)
    robot.cable.retardation_time = random.uniform(5e-5, 1e-3)
    robot.platform.mass *= random.uniform(0.7, 2.0)
    flat = np.array([1.0, 1.0, 0.0 if robot.is_planar() else 1.0])
    for cable in robot.cables:
        cable.exit_point = cable.exit_point + random.uniform(-0.03, 0.03, 3) * flat
    pulleys = bool(random.integers(2)) and not robot.is_planar()
    return robot, CableRobotSettings(cables=CableSettings(pulleys=pulleys))


def taut_velocities(robot: Robot, settings: CableRobotSettings, seed: int) -> Array:
    """Cable velocities that lead the platform on a slow loop and back, shape (k, m) [m/s]."""
    random = np.random.default_rng(seed)
    cables, home = settings.cables.cable_set(robot), robot.home.transform()
    flat = np.array([1.0, 1.0, 0.0 if robot.is_planar() else 1.0])
    size = AMPLITUDE * random.uniform(-1.0, 1.0, (2, 3)) * flat
    times = np.arange(round(TAUT_DURATION / TAUT_PERIOD) + 1) * TAUT_PERIOD
    phase = 2.0 * np.pi * times / TAUT_DURATION
    lengths = []
    for p in phase:
        away = size[0] * (1.0 - np.cos(p)) / 2.0 + size[1] * (1.0 - np.cos(2.0 * p)) / 2.0
        X_WP = RigidTransform(home.rotation(), home.translation() + away)
        lengths.append(cable_paths(X_WP, cables).lengths)
    return np.asarray(np.diff(lengths, axis=0) / TAUT_PERIOD)


@dataclass(frozen=True)
class TautTask:
    """Robots that are drawn, on slow loops with cables taut; the item is the seed."""

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """Largest distance [m], angle [rad] and relative energy difference, and least tension [N],
        shape (n, 4)."""
        return {"taut": np.array([self._one(seed) for seed in range(start, stop)])}

    def _one(self, seed: int) -> list[float]:
        robot, settings = drawn_robot(seed)
        home = robot.home.transform()
        velocities = taut_velocities(robot, settings, seed)
        step = automatic_step(robot, home, "runge_kutta3", settings)
        found = [
            commanded_path(
                kind, robot, settings, home, velocities, TAUT_PERIOD, rule=StepRule(max_step=step)
            )
            for kind in (CableRobot, CompiledCableRobot)
        ]
        (one, l0, tensions), (other, l0_other, _) = found
        distance, angle = state_distance(one, other)
        motion = CompiledCableRobot(robot, settings).motion
        energies = [
            np.array([motion.energy_of(np.concatenate(row)) for row in zip(*rows, strict=True)])
            for rows in ((one, l0), (other, l0_other))
        ]
        size = robot.platform.mass * 9.81 * AMPLITUDE
        difference = np.max(np.abs(energies[0] - energies[1])) / size
        return [
            float(np.max(distance)), float(np.max(angle)), float(difference),
            float(np.min(tensions)),
        ]  # fmt: skip


def soft_robot() -> Robot:
    """ACROBOT on softer cables, undamped."""
    robot = load_robot("acrobot_small")
    robot.cable.youngs_modulus /= SOFTER
    return robot


@dataclass(frozen=True)
class OrderTask:
    """ACROBOT on soft cables, by each method at one step; the item is the step.

    It stands at home, and its winches run; with `slack` its cables are paid out before, and catch.
    """

    slack: float

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """Distance to the plant at a small step, by `METHODS`, shape (n, 3) [m]."""
        settings = CableRobotSettings(cables=CableSettings(model="elastic"))
        reference = self._path(
            CableRobot, settings, StepRule(method="runge_kutta3", max_step=REFERENCE_STEP)
        )
        rows = []
        for step in DROP_STEPS[start:stop]:
            row = []
            for method in METHODS:
                rule = StepRule(method=method, max_step=step)
                found = self._path(CompiledCableRobot, settings, rule)
                row.append(float(np.max(state_distance(found, reference)[0])))
            rows.append(row)
        return {"distance": np.array(rows)}

    def _path(
        self,
        kind: type[CableRobot | CompiledCableRobot],
        settings: CableRobotSettings,
        rule: StepRule,
    ) -> Array:
        robot = soft_robot()
        velocities = np.tile(np.linspace(-0.05, 0.0, 8), (4, 1))
        states, _, _ = commanded_path(
            kind, robot, settings, robot.home.transform(), velocities, DROP_DURATION / 4,
            rule=rule, slack=np.full(8, self.slack) if self.slack > 0.0 else None,
        )  # fmt: skip
        return states


@dataclass(frozen=True)
class EnergyTask:
    """ACROBOT on its real cables, undamped and slack at the start, halted; the item is the step."""

    duration: float

    def __call__(self, start: int, stop: int) -> dict[str, Array]:
        """Changes of the energy over that of the fall, shape (n, 5): the largest and the least by
        runge_kutta3, the largest by semi_implicit; most cables slack, largest tension [N]."""
        return {"energy": np.array([self._one(step) for step in ENERGY_STEPS[start:stop]])}

    def _one(self, step: float) -> list[float]:
        robot = load_robot("acrobot_small")
        settings = CableRobotSettings(cables=CableSettings(model="elastic"))
        motion = CompiledCableRobot(robot, settings).motion
        fall = robot.platform.mass * robot.gravity * ENERGY_SLACK
        row: list[float] = []
        slack = tension = 0.0
        for method in (EXPLICIT, SEMI_IMPLICIT):
            states, l0, tensions = commanded_path(
                CompiledCableRobot, robot, settings, robot.home.transform(),
                np.zeros((round(self.duration / 0.01), 8)), 0.01,
                rule=StepRule(method=method, max_step=step), slack=np.full(8, ENERGY_SLACK),
            )  # fmt: skip
            energies = [motion.energy_of(np.concatenate(r)) for r in zip(states, l0, strict=True)]
            row.append(float(np.max(np.array(energies) - energies[0]) / fall))
            if method == EXPLICIT:
                row.append(float(np.min(np.array(energies) - energies[0]) / fall))
                slack = float(np.max(np.sum(tensions == 0.0, axis=1)))
                tension = float(np.max(tensions))
        return [*row, slack, tension]


def servo_steps(quick: bool) -> StepTask:
    """Steps at which the servo with impacts is compared."""
    base = StepTask(steps=(1e-3, 5e-4, 2.5e-4), duration=2.0)
    return replace(base, steps=base.steps[:2], duration=0.6) if quick else base
