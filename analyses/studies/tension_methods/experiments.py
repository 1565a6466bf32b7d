"""The runs of the study of tension methods: the Gazebo thesis' experiment, and one on ACROBOT."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from cdpr_drake.analyses.statics.tension_query import applicable_methods
from cdpr_drake.analyses.studies.tension_methods.feasible_path import HeldPath, held_path
from cdpr_drake.analyses.studies.tension_methods.trial import Applied, TensionTrial
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem

THESIS_ROBOT = "caroca_gazebo"
OTHER_ROBOT = "acrobot_large"

THESIS_START = (0.0, -2.0, 2.0)
THESIS_END = (3.0, 1.0, 3.0)
"""Gazebo thesis 6.2, the middle of the platform [m]."""

THESIS_DURATION = 100.0
"""Gazebo thesis 6.2 [s]."""

THESIS_GAINS: dict[str, tuple[float, ...]] = {
    "linear_program": (100.0, 800.0, 1200.0),
    "quadratic_program": (100.0, 800.0, 1200.0, 1500.0),
    "pseudo_inverse": (100.0, 800.0, 1200.0),
    "closed_form": (100.0, 800.0, 1200.0),
}
"""Kp = Kd of the methods that the Gazebo thesis runs, figures 6.8 to 6.20 [1/s^2, 1/s]."""

UNCHECKED = ("pseudo_inverse", "closed_form")
"""Methods of the thesis that may leave the bounds."""

STEPS_BELOW = {"step": 0.005, "far_step": 0.05}
"""How far below its goal the platform starts in two experiments, chosen [m]."""

EXPERIMENTS = {
    "thesis": "The Gazebo thesis' trajectory, its start moved inside; Kp = Kd, 1 kHz.",
    "printed": "The same with its printed start, which no tensions within bounds hold.",
    "step": f"The thesis' robot {1e3 * STEPS_BELOW['step']:g} mm below its goal, at rest.",
    "far_step": f"The thesis' robot {1e3 * STEPS_BELOW['far_step']:g} mm below its goal, at rest.",
    "slow": "The thesis' trajectory, its first part, controlled at 100 Hz.",
    "acrobot": "acrobot_large there and back, Kp = 100, Kd = 20, 1 kHz.",
}
"""What the experiments are, by name."""


GRID, QUICK_GRID = (13, 13, 9), (5, 5, 3)
"""Poses on which methods are compared, along x, y and z."""


@cache
def thesis_path() -> HeldPath:
    """How the thesis' path was moved inside; positions of Po."""
    robot = load_robot(THESIS_ROBOT)
    return held_path(robot, *printed_ends(), robot.home.position)


def printed_ends() -> tuple[np.ndarray, np.ndarray]:
    """Where the thesis' path starts and ends, shape (3,) each, of Po [m]."""
    # The thesis' platform frame lies in the middle of the box, P in the middle of its bottom.
    middle = np.array([0.0, 0.0, float(load_robot(THESIS_ROBOT).platform.size[2]) / 2.0])
    return np.array(THESIS_START) - middle, np.array(THESIS_END) - middle


def trials(quick: bool) -> list[TensionTrial]:
    """All runs, or short ones that only show that everything works, in the order of the
    experiments."""
    specs = _thesis(thesis_path(), quick) + _printed(printed_ends(), quick) + _acrobot(quick)
    if not quick:
        specs += _step() + _slow(thesis_path())
    order = list(EXPERIMENTS)
    return sorted(specs, key=lambda spec: order.index(spec.experiment))


def _straight(start: np.ndarray, end: np.ndarray, duration: float) -> dict[str, Any]:
    poses = tuple(pose_from_angles(p, np.zeros(3)) for p in (start, end))
    return {"path": poses, "legs": (duration,)}


def _thesis(path: HeldPath, quick: bool) -> list[TensionTrial]:
    duration = 1.0 if quick else THESIS_DURATION
    way = _straight(path.start, path.end, THESIS_DURATION)

    def spec(method: str, gain: float, applied: Applied = Applied.HELD) -> TensionTrial:
        return TensionTrial(
            experiment="thesis",
            robot=THESIS_ROBOT,
            **way,
            method=method,
            stiffness=gain,
            damping=gain,
            duration=duration,
            applied=applied,
        )

    specs = []
    for method, gains in THESIS_GAINS.items():
        for gain in gains[:1] if quick else gains:
            specs.append(spec(method, gain))
            if method in UNCHECKED:
                specs += [spec(method, gain, how) for how in (Applied.CUT, Applied.PUSHED)]
    if not quick:
        specs += [spec(method, 100.0) for method in ("improved_closed_form", "barycenter")]
    return specs


def _printed(ends: tuple[np.ndarray, np.ndarray], quick: bool) -> list[TensionTrial]:
    way = _straight(*ends, THESIS_DURATION)
    return [
        TensionTrial(
            experiment="printed",
            robot=THESIS_ROBOT,
            **way,
            method=method,
            stiffness=gain,
            damping=gain,
            duration=0.5 if quick else THESIS_DURATION,
            applied=Applied.PUSHED,
        )
        for method in UNCHECKED
        for gain in (THESIS_GAINS[method][:1] if quick else THESIS_GAINS[method])
    ]


def _step() -> list[TensionTrial]:
    home = load_robot(THESIS_ROBOT).home.position
    return [
        TensionTrial(
            experiment=experiment,
            robot=THESIS_ROBOT,
            **_straight(home, home, 1.0),
            method=method,
            stiffness=gain,
            damping=gain,
            duration=8.0,
            offset=(0.0, 0.0, -below),
        )
        for experiment, below in STEPS_BELOW.items()
        for method in ("linear_program", "quadratic_program")
        for gain in THESIS_GAINS[method]
    ]


def _slow(path: HeldPath) -> list[TensionTrial]:
    return [
        TensionTrial(
            experiment="slow",
            robot=THESIS_ROBOT,
            **_straight(path.start, path.end, THESIS_DURATION),
            method="quadratic_program",
            stiffness=gain,
            damping=gain,
            duration=20.0,
            rate=100.0,
        )
        for gain in THESIS_GAINS["quadratic_program"]
    ]


def _acrobot(quick: bool) -> list[TensionTrial]:
    robot = load_robot(OTHER_ROBOT)
    home = robot.home.transform()
    away = pose_from_angles(
        home.translation() + np.array([0.2, -0.15, 0.25]), np.radians([4.0, -3.0, 6.0])
    )
    leg = 2.0
    methods = applicable_methods(tension_problem(robot, home))
    if quick:
        methods = ["quadratic_program", "improved_closed_form"]
    return [
        TensionTrial(
            experiment="acrobot",
            robot=OTHER_ROBOT,
            path=(home, away, home),
            legs=(leg, leg),
            method=method,
            stiffness=100.0,
            damping=20.0,
            duration=0.5 if quick else 2.0 * leg + 0.5,
        )
        for method in methods
    ]
