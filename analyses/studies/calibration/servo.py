"""What a visual servo gains from a calibrated robot: how straight the camera moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pydrake.common.yaml import yaml_dump_typed

from cdpr_drake.analyses.calibration.calibrated_robots import calibrated_robot
from cdpr_drake.analyses.simulation.run_summary import camera_path
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.analyses.studies.calibration.trials import (
    LENGTH_SIGMA,
    MOUNT,
    ROBOT,
    CameraTrial,
    robot_lengths,
)
from cdpr_drake.calibration.parameters import CalibrationModel
from cdpr_drake.calibration.pose_search import guessed_stations
from cdpr_drake.calibration.program import CalibrationProgram
from cdpr_drake.geometry.pose_accuracy import distances_from_line
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.systems.diagrams.load import load_scenario

SCENARIO = "acrobot_pbvs_line"
CHANGES = ("camera.kind=projected", "camera.pixel_noise=0.0", "integration.engine=compiled")
"""Without noise of the image, so that only the model bends the path."""

MODELS = ("true", "believed before", "calibrated")


def straightness(trial: CameraTrial) -> dict[str, float]:
    """Largest distance of the camera's path from the straight line, by what is believed [m].

    The platform's first pose is believed to be where each robot's own lengths put it, as a winch
    controller would have it: in the frames of that robot.
    """
    found = {}
    robot = load_robot(ROBOT)
    for name in MODELS:
        scenario = load_scenario(SCENARIO, CHANGES)
        X_WP = scenario.initial_pose.transform()
        with TemporaryDirectory() as folder:
            if name != "true":
                calibrated = name == "calibrated"
                model = trial.result.model if calibrated else trial.believed
                result = replace(trial.result, model=model)
                path = Path(folder) / "robot.yaml"
                believed = calibrated_robot(robot, result, MOUNT)[0]
                path.write_text(yaml_dump_typed(believed), encoding="utf-8")
                scenario.perturbations.believed_robot = str(path)
                scenario.perturbations.initial_pose = _seen_from(model, scenario.initial_pose)
            run = run_scenario(scenario)
        path_W, line = camera_path(run)
        found[name] = float(np.max(distances_from_line(path_W, *line)))
        assert X_WP.IsExactlyEqualTo(scenario.initial_pose.transform())
    return found


def _seen_from(model: CalibrationModel, pose: Pose) -> Pose:
    """The pose at which a robot that is believed has the true one's lengths."""
    X_WP = pose.transform()
    lengths = robot_lengths(load_robot(ROBOT), X_WP)[None]
    program = CalibrationProgram(model, [X_WP], ())
    program.AddLengths(lengths, LENGTH_SIGMA)
    (X,) = guessed_stations(model, program.terms, 1, X_WP).poses()
    angles = np.degrees(angles_from_rotation(X.rotation()))
    return Pose(position=np.array(X.translation()), angles_deg=angles)
