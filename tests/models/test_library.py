"""Every robot of the package loads, hangs, steps, is exported, and says its sources."""

import re
from importlib.resources import files

import numpy as np
import pytest
import yaml
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from cdpr_drake.errors import RobotFileError
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.robot_exchange import export_robot
from cdpr_drake.models.robot_exports import EXPORTS
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step

STILL = 1e-6
"""A robot in equilibrium moves by round-off only; a micrometre and a microradian."""

BOUND_ROUND_OFF = 1e-9
"""Tensions may leave their bounds by the round-off of lengths times stiffness, as a share of it."""

STEPS = 5

ROBOTS = files("cdpr_drake.models").joinpath("robots")


def exported(robot, format):
    """Files by name, or why there are none."""
    try:
        return export_robot(robot, format)
    except RobotFileError as problem:
        return str(problem)


@pytest.mark.parametrize("name", robot_names())
def test_loads_hangs_steps_and_is_exported(name):
    robot = load_robot(name)
    home = robot.home.transform()
    block = CableRobot(robot)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, home)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(len(robot.cables)))
    start = block.GetOutputPort("X_WP").Eval(context)
    step = automatic_step(robot, start, "runge_kutta3")
    ResetIntegratorFromFlags(simulator, "runge_kutta3", step).set_fixed_step_mode(True)
    simulator.AdvanceTo(STEPS * step)
    distance, angle = pose_error(start, block.GetOutputPort("X_WP").Eval(context))
    assert distance < STILL
    assert angle < STILL
    tensions = block.GetOutputPort("tensions").Eval(context)
    off = BOUND_ROUND_OFF * np.max(robot.stiffness())
    assert np.all(tensions >= robot.tension_bounds.lower - off)
    assert np.all(tensions <= robot.tension_bounds.upper + off)
    written = {format: exported(robot, format) for format in EXPORTS}
    assert isinstance(written["mjcf"], dict)
    firmwares = ("klipper", "reprapfirmware", "maslow")  # which know points alone
    for format, found in written.items():
        if isinstance(found, str):  # a format that cannot hold the motion type says so
            assert robot.motion != "3R3T" or format in firmwares
            assert f"motion: found {robot.motion}" in found
        else:
            assert found
            assert all(len(words) > 100 for words in found.values())


@pytest.mark.parametrize("name", robot_names())
def test_says_where_its_numbers_are_from(name):
    folder = ROBOTS.joinpath(name)
    words = folder.joinpath("README.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1:3] for line in words.splitlines() if line.startswith("| ")][2:]
    assert len(rows) >= 2
    assert all(source.strip() for _, source in rows)
    named = re.compile(r"thesis|github\.com|WireCenter|assumptions|caroca|published")
    assert any(named.search(source) for _, source in rows)
    content = yaml.safe_load(folder.joinpath("robot.yaml").read_text(encoding="utf-8"))
    assert content["assumptions"]


def test_the_literature_is_there():
    """By family: ACROBOT and CAROCA have several robots each."""
    several = ("acrobot", "caroca")
    families = {next((s for s in several if name.startswith(s)), name) for name in robot_names()}
    assert len(families) >= 14
