"""Benchmarks of visual servoing: one control step, from a measured target to cable velocities, one
of tension management beside it, and the search for a target in an image."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, seconds_per_call
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import adjoint
from cdpr_drake.geometry.straight_cables import length_jacobian
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.servo_law import AdaptiveGain
from cdpr_drake.systems.controllers.correction_laws import CorrectionReadings
from cdpr_drake.systems.controllers.feature_servo import control_step
from cdpr_drake.systems.diagrams.beliefs import believed_robot
from cdpr_drake.systems.diagrams.controller import make_controller
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_management import correction_law
from cdpr_drake.systems.diagrams.torque_control import torque_law
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget, Target
from cdpr_drake.vision.texture_pictures import drawn_image
from cdpr_drake.vision.textured_target import TexturedTarget

BUDGET_US = 60.0
"""What one control step may take [us]."""

SCENARIOS = {
    "pbvs": "acrobot_pbvs",
    "pbvs-line": "acrobot_pbvs_line",
    "2.5d": "acrobot_hybrid",
    "ibvs": "acrobot_ibvs",
    "circles": "acrobot_circles",
    "partitioned": "acrobot_partitioned",
    "switching": "acrobot_switching",
}

CORRECTIONS = {
    "constant": "{kind: constant, gain: 0.04}",
    "adaptive": "{kind: adaptive}",
    "by_length": "{kind: by_length, gain: 0.04, highest: [3], shortest: 0.6, longest: 1.4}",
    "distribution": "{kind: distribution, integral: 0.01}",
    "length": "{kind: length}",
}
"""Sections `tension_management` of which a step is timed."""


def servo_rows(quick: bool) -> list[TimingRow]:
    """One row a scheme, and one for IBVS against plain NumPy; `quick` times less."""
    repeats, calls = (3, 200) if quick else (9, 2000)
    rows = [step_row(scheme, repeats, calls) for scheme in SCENARIOS]
    rows += [correction_row(kind, repeats, calls) for kind in CORRECTIONS]
    rows += [torque_row(repeats, calls), numpy_row(repeats, calls)]
    return [*rows, *texture_rows(repeats, 2 if quick else 20)]


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
        self.target: Target = scenario.target.target()
        self.X_WP: RigidTransform = scenario.initial_pose.transform()
        self.X_PC: RigidTransform = mount.pose.transform()
        X_WO = scenario.target.path().at(0.0)
        self.X_CO: RigidTransform = (self.X_WP @ self.X_PC).inverse() @ X_WO
        marks = self.target.project(self.X_CO, self.pinhole, 0.0, np.random.default_rng(0))
        assert marks is not None
        self.marks: Array = marks
        self.controller: ServoController = make_controller(
            scenario, believed_robot(scenario, robot), self.target, self.pinhole
        )
        self._memory = self.controller.fresh_memory()

    def __call__(self) -> Array:
        """Performs it; returns the cable velocities, shape (m,) [m/s]."""
        command, self._memory = control_step(
            self.controller,
            self._memory,
            (self.target, self.pinhole),
            (self.X_CO, self.marks),
            self.X_WP,
            0.5,
        )
        return command.cable_velocities


def numpy_step(step: Step, scenario: Scenario) -> Callable[[], Array]:
    """The same IBVS step as one writes it in NumPy, without a continuous start."""
    robot = load_robot(scenario.robot)
    cables, speed = robot.cable_set().without_pulleys(), robot.winch.rated_cable_speed()
    assert isinstance(step.target, PointTarget)
    corners = step.target.points
    c, pinhole = scenario.controller, step.pinhole
    gain = AdaptiveGain(c.lambda_0, c.lambda_infinity, c.lambda_slope)
    desired = step.target.ideal_marks(scenario.desired.transform())

    def work() -> Array:
        uv = step.marks.reshape(-1, 2).T
        points = np.array([(uv[0] - pinhole.cx) / pinhole.fx, (uv[1] - pinhole.cy) / pinhole.fy])
        depths = (step.X_CO @ corners)[2]
        rows = []
        for (x, y), Z in zip(points.T, depths, strict=True):
            rows.append([x * y, -(1 + x * x), y, -1 / Z, 0.0, x / Z])
            rows.append([1 + y * y, -x * y, -x, 0.0, -1 / Z, y / Z])
        error = (points - desired).T.ravel()
        V_C = -gain(error) * np.linalg.pinv(np.array(rows)) @ error
        V_P = adjoint(step.X_PC) @ V_C
        R = step.X_WP.rotation().matrix()
        V_WP = np.concatenate([R @ V_P[:3], R @ V_P[3:]])
        rates = length_jacobian(step.X_WP, cables.p_WA, cables.p_PB) @ V_WP
        return np.asarray(rates * min(1.0, speed / float(np.max(np.abs(rates)))))

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
        ratio_means="share of the budget; pose solver not included",
    )


TORQUE_BUDGET_US = 200.0
"""What one step from a servo's twist to motor torques may take, a fifth of its millisecond [us]."""


def torque_row(repeats: int, calls: int) -> TimingRow:
    """One step of the fast loop of a servo by torque, from twist to torques, against its budget."""
    scenario = load_scenario("acrobot_torque_servo")
    robot = load_robot(scenario.robot)
    settings, X_WP = scenario.torque_control, scenario.initial_pose.transform()
    law = torque_law(settings, robot, believed_robot(scenario, robot), scenario)
    wanted = np.array([0.05, -0.02, 0.1, 0.03, -0.05, 0.02])
    readings = np.array([np.full(law.cable_count, 6.0), np.zeros(law.cable_count)])
    _, memory = law.step(law.fresh_memory(), wanted, X_WP, readings, 0.0)

    def work() -> Array:
        return law.step(memory, wanted, X_WP, readings, 0.02)[0].torques

    (time,) = interleaved([lambda: seconds_per_call(work, calls)], repeats)
    return TimingRow(
        "torque step, barycenter",
        1e6 * time,
        "us/step",
        "budget",
        TORQUE_BUDGET_US,
        1e6 * time / TORQUE_BUDGET_US,
        ratio_means="share of the budget; twist, wrench, tensions, torques",
    )


def texture_rows(repeats: int, calls: int) -> list[TimingRow]:
    """A textured square in an image of 640 x 480 px, where it was and by features, beside a tag."""
    scenario = load_scenario("acrobot_pbvs_textured")
    pinhole = load_camera(load_robot(scenario.robot).camera_mount("onboard").model).pinhole(
        640, 480
    )
    textured, tag = (
        TexturedTarget("stones", scenario.target.size),
        TagTarget(0, scenario.target.size),
    )
    X_CO = scenario.desired.transform()
    before = textured.project(X_CO, pinhole, 0.0, np.random.default_rng(0))
    image, tag_image = (drawn_image(target, X_CO, pinhole) for target in (textured, tag))
    assert before is not None
    beside = before + 1.0
    followed, anywhere, found = interleaved(
        [
            lambda: seconds_per_call(lambda: textured.follow(image, beside), calls),
            lambda: seconds_per_call(lambda: textured.follow(image, None), calls),
            lambda: seconds_per_call(lambda: tag.find(tag_image), calls),
        ],
        repeats,
    )
    return [
        TimingRow(
            f"texture, {how}", 1e3 * time, "ms/image", "AprilTag", 1e3 * found, time / found,
            ratio_means="of the time in which OpenCV finds a tag as large",
        )
        for how, time in (("followed", followed), ("found by features", anywhere))
    ]  # fmt: skip


class Correction:
    """One step of tension management at the start of a scenario, ready to be repeated."""

    def __init__(self, scenario: Scenario) -> None:
        settings = scenario.tension_management
        assert settings is not None
        robot, X_WP = load_robot(scenario.robot), scenario.initial_pose.transform()
        cables = believed_robot(scenario, robot).cables.without_pulleys()
        fastest = robot.winch.rated_cable_speed()
        self._law = correction_law(settings, robot, cables, fastest)
        lengths = cable_paths(X_WP, cables).lengths + 0.01
        tensions = np.linspace(0.0, 2.0, cables.count)  # half of them below the threshold
        self._there = {"tensions": tensions, "lengths": lengths, "X_WP": X_WP}
        self._period = 1.0 / scenario.controller.rate
        self._memory = np.zeros(self._law.memory)

    def __call__(self) -> Array:
        """Performs it; returns what is added to the cable velocities, shape (m,) [m/s]."""
        readings = CorrectionReadings(self._there.__getitem__, self._period)
        return self._law.step(readings, self._memory)[0]


def correction_row(kind: str, repeats: int, calls: int) -> TimingRow:
    """A step of one kind of tension management beside the servo's own step."""
    scenario = load_scenario(
        "acrobot_slack_start", [f"tension_management={CORRECTIONS[kind]}", "camera.kind=projected"]
    )
    correction, servo = Correction(scenario), Step(scenario)
    added, own = interleaved(
        [lambda: seconds_per_call(correction, calls), lambda: seconds_per_call(servo, calls)],
        repeats,
    )
    return TimingRow(
        f"tension correction, {kind}",
        1e6 * added,
        "us/step",
        "control step, 2.5d",
        1e6 * own,
        added / own,
        ratio_means="of the servo's own step",
    )


def numpy_row(repeats: int, calls: int) -> TimingRow:
    """IBVS against the same formulas in plain NumPy, which know no other scheme and no start."""
    scenario = load_scenario(SCENARIOS["ibvs"])
    step = Step(scenario)
    plain = numpy_step(step, scenario)
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
        ratio_means="times faster than NumPy",
    )
