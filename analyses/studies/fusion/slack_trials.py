"""Starts with slack cables, as in case study IX: what takes it up how soon, and how it is seen."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr_drake.analyses.simulation.visual_servo_run import RunResult, run_scenario
from cdpr_drake.analyses.studies.framework.experiments import wrong_points
from cdpr_drake.analyses.studies.framework.study import Case
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.systems.cameras.cable_camera import CableCamera
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.vision.cable_images import slack_from_image

SLACK_SCENARIO = "acrobot_slack_start_tca"

WAYS = {
    "constant": "{kind: constant, threshold: [1.0], gain: 0.04}",
    "adaptive": "{kind: adaptive, gain_per_length: 2}",
    "length": "{kind: length}",
    "image": "{kind: image, gain: 0.04, allowance: 0.002}",
}
"""Ways to take up slack: the published one, its variants that know lengths, what a camera sees."""

SURPLUSES = (0.02, 0.04, 0.08)
"""Lengths that two cables are too long by at the start [m]."""

CABLES = (0, 1)

DURATION, LOG_RATE = 4.0, 50.0

TAUT = 1e-3
"""A cable that is too long by less counts as taut [m]."""

POINTS, NOISE = 15, 0.5
"""Points of a cable in the image, and their standard deviation [px]."""

WRONG = (
    "perturbations.initial_pose_shift={distance: 0.002, angle_deg: 0.2}",
    *wrong_points(),
)
"""What is believed wrongly, as in case study IX."""


def measure_slack(case: Case, seed: int) -> dict[str, Any]:
    """A start with slack cables.

    Returns:
        taut_s: when the last slack cable became taut; fastest_m_s: the fastest correction;
        estimate_m: the largest error of the pose estimate; of the slack that a camera sees while
        there is some, seen_error_m and seen_bias_m: the mean size of the error and the mean error,
        and seen_share: the share of images with it.
    """
    way, surplus = case.keys["way"], case.keys["surplus_m"]
    slack = [surplus if k in CABLES else 0.0 for k in range(8)]
    changes = [
        "camera.kind=projected", "integration.engine=compiled", f"duration={DURATION}",
        f"log_rate={LOG_RATE}", f"seed={seed}", "stop.target_lost=1000",
        f"perturbations.slack={slack}", f"tension_management={WAYS[way]}", *WRONG,
    ]  # fmt: skip
    result = run_scenario(load_scenario(SLACK_SCENARIO, changes))
    log, columns = result.log, list(CABLES)
    slackness = log["surplus_lengths"][:, columns]
    rows = np.flatnonzero(np.any(slackness > TAUT, axis=1))
    apart = np.linalg.norm(log["X_WP"][:, 4:] - log["X_WP_estimated"][:, 4:], axis=1)
    errors, looked = _seen_errors(result, seed)
    seen = errors[np.isfinite(errors)]
    return {
        "taut_s": log["time"][rows[-1]] if len(rows) else 0.0,
        "fastest_m_s": np.max(-log["tension_corrections"]),
        "estimate_m": np.max(apart),
        "seen_error_m": np.mean(np.abs(seen)) if len(seen) else np.nan,
        "seen_bias_m": np.mean(seen) if len(seen) else np.nan,
        "seen_share": len(seen) / looked if looked else np.nan,
    }


def _seen_errors(result: RunResult, seed: int) -> tuple[Array, int]:
    """Errors of the slack that the robot's camera in the world sees in the rows of a log, for
    cables that are slack [m], NaN where it is not seen, and how many there are."""
    log, servo = result.log, result.servo
    robot, cables = servo.robot, servo.believed.cables.without_pulleys()
    mount = robot.camera_mount("overview")
    lens = load_camera(mount.model)
    pinhole, X_WE = lens.pinhole(lens.width, lens.height), mount.pose.transform()
    true = CompiledCableRobot(robot, servo.scenario).forces
    camera = CableCamera(
        true.cable_set(), true.model(), X_WE, pinhole, LOG_RATE,
        points=POINTS, noise=NOISE, seed=seed,
    )  # fmt: skip
    found = list[float]()
    for k, surplus in enumerate(log["surplus_lengths"][:, list(CABLES)]):
        if not np.any(surplus > TAUT):
            continue
        pixels = camera.look(pose_from_row(log["X_WP"][k]), log["unstrained_lengths"][k], k)
        try:
            seen = slack_from_image(
                pixels.reshape(len(robot.cables), 2, -1), cables,
                pose_from_row(log["X_WP_estimated"][k]), X_WE, pinhole, NOISE,
            ).surplus[list(CABLES)]  # fmt: skip
        except CableGeometryError:
            continue
        found += (seen - surplus)[surplus > TAUT].tolist()
    return np.array(found), len(found)
