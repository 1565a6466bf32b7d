"""Benchmarks of visual servoing: one control step, from a measured target to cable velocities."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.timing import TimingRow, interleaved, seconds_per_call
from cdpr_drake.arrays import Array
from cdpr_drake.cable_geometry import length_jacobian
from cdpr_drake.models import load_camera, load_robot
from cdpr_drake.pinhole import Pinhole
from cdpr_drake.poses import adjoint
from cdpr_drake.servo_controller import ServoController
from cdpr_drake.servo_law import AdaptiveGain
from cdpr_drake.systems import Scenario, load_scenario, make_servo_model
from cdpr_drake.systems.feature_servo import make_sighting
from cdpr_drake.systems.servo_schemes import make_controller
from cdpr_drake.systems.targets import make_target
from cdpr_drake.target import Target

BUDGET_US = 60.0
"""What one control step may take [us]."""

SCENARIOS = {
    "pbvs": "acrobot_pbvs",
    "pbvs-line": "acrobot_pbvs_line",
    "2.5d": "acrobot_hybrid",
    "ibvs": "acrobot_ibvs",
    "circles": "acrobot_circles",
}


def servo_rows(quick: bool) -> list[TimingRow]:
    """One row a scheme, and one for IBVS against plain NumPy; `quick` times less."""
    repeats, calls = (3, 200) if quick else (9, 2000)
    rows = [step_row(scheme, repeats, calls) for scheme in SCENARIOS]
    return [*rows, numpy_row(repeats, calls)]


class Step:
    """One control step of a scenario, ready to be repeated.

    What is timed is everything between the target's measured marks and pose, which the camera's
    block has from the pose solver, and the cable velocities: marks at unit focal length, features,
    interaction matrix, gain, continuous start, least squares, adjoint, cable Jacobian, saturation.
    """

    def __init__(self, scenario: Scenario) -> None:
        robot = load_robot(scenario.robot)
        mount = robot.camera_mount(scenario.camera.mount)
        self.pinhole: Pinhole = load_camera(mount.model).pinhole(640, 480)
        self.target: Target = make_target(scenario.target)
        self.X_WP: RigidTransform = scenario.initial_pose.transform()
        self.X_PC: RigidTransform = mount.pose.transform()
        X_WO = scenario.target.path().at(0.0)
        self.X_CO: RigidTransform = (self.X_WP @ self.X_PC).inverse() @ X_WO
        marks = self.target.project(self.X_CO, self.pinhole, 0.0, np.random.default_rng(0))
        assert marks is not None
        self.marks: Array = marks
        self.controller: ServoController = make_controller(
            scenario, make_servo_model(scenario, robot), self.target
        )
        self._memory = self.controller.fresh_memory()
        self._pose = self.X_WP.rotation().matrix(), self.X_WP.translation()

    def __call__(self) -> None:
        """Performs it."""
        features = self.controller.tasks[0].features
        seen = make_sighting(features, self.target, self.pinhole, self.X_CO, self.marks)
        _, self._memory = self.controller.step(self._memory, seen, *self._pose, 0.5)


def numpy_step(step: Step, gain: AdaptiveGain) -> Callable[[], Array]:
    """IBVS as one writes it from the formulas, without the continuous start."""
    robot = load_robot("acrobot_small")
    A, B = robot.exit_points(), robot.anchor_points()
    points = step.target.ideal_marks(step.X_CO)
    desired = step.target.ideal_marks(RigidTransform(step.X_CO.rotation(), [0.0, 0.0, 0.09]))
    depth = float(step.X_CO.translation()[2])

    def work() -> Array:
        rows = []
        for x, y in points.T:
            Z = depth
            rows.append([x * y, -(1 + x * x), y, -1 / Z, 0.0, x / Z])
            rows.append([1 + y * y, -x * y, -x, 0.0, -1 / Z, y / Z])
        error = (points - desired).T.ravel()
        V_C = -gain(error) * np.linalg.pinv(np.array(rows)) @ error
        V_P = adjoint(step.X_PC) @ V_C
        R = step.X_WP.rotation().matrix()
        V_WP = np.concatenate([R @ V_P[:3], R @ V_P[3:]])
        rates = length_jacobian(step.X_WP, A, B) @ V_WP
        return np.asarray(rates * min(1.0, 1.0 / float(np.max(np.abs(rates)))))

    return work


def step_row(scheme: str, repeats: int, calls: int) -> TimingRow:
    """The control step of one scheme against its budget."""
    step = Step(load_scenario(SCENARIOS[scheme]))
    (time,) = interleaved([lambda: seconds_per_call(step, calls)], repeats)
    return TimingRow(
        f"control step, {scheme}",
        1e6 * time,
        "us/step",
        "budget",
        BUDGET_US,
        1e6 * time / BUDGET_US,
        "share of the budget; pose solver not included",
    )


def numpy_row(repeats: int, calls: int) -> TimingRow:
    """IBVS against the same formulas in plain NumPy, which do less."""
    step = Step(load_scenario(SCENARIOS["ibvs"]))
    plain = numpy_step(step, AdaptiveGain(2.0, 0.3, 30.0))
    fast, slow = interleaved(
        [lambda: seconds_per_call(step, calls), lambda: seconds_per_call(plain, calls // 4)],
        repeats,
    )
    return TimingRow(
        "control step, ibvs",
        1e6 * fast,
        "us/step",
        "plain NumPy, without start",
        1e6 * slow,
        slow / fast,
        "times faster than NumPy",
    )
