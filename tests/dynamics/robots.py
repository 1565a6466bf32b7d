"""Robots for the tests of this folder."""

from dataclasses import replace

import numpy as np

from cdpr_drake.dynamics.robot_arrays import Drive, pack_robot
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform


def robot_arrays(
    name, *, model="kelvin_voigt", pulleys=False, drive=None, softer=1.0, damping=(0.0, 0.0)
):
    """A shipped robot, its state at rest at home with cables 0.2 % short, times the softness."""
    robot = load_robot(name)
    robot.cable.youngs_modulus /= softer
    cables: CableSet = robot.cable_set()
    cables = cables if pulleys else cables.without_pulleys()
    if model == "elastic":
        cables = replace(cables, retardation=np.zeros(cables.count))
    X_WP = robot.home.transform()
    lengths = cable_paths(X_WP, cables).lengths
    drive = drive or Drive(rated_speed=1.0)
    arrays = pack_robot(
        rigid_platform(robot), cables, model, drive,
        home=lengths, joint=robot.joint(), damping=damping,
    )  # fmt: skip
    if not robot.joint().is_floating:
        platform = np.concatenate([X_WP.translation()[:2], np.zeros(4)])
    else:
        platform = np.concatenate([pose_row(X_WP), np.zeros(6)])
    states = drive.states_per_cable()
    winch = np.zeros((states, cables.count))
    if states:
        winch[0] = lengths * (1.0 - 2e-6 * softer)
    return arrays, np.concatenate([platform, winch.ravel()]), cables
