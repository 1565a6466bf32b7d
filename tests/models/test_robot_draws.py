"""Robots drawn from covariances that calibrations and identifications write."""

import json

import numpy as np
import pytest

from cdpr_drake.errors import DataFileError, RobotFileError
from cdpr_drake.models.robot_draws import ParameterCovariance, drawn_robots
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_parameters import changed_robot, parameter_names

ROBOT = load_robot("acrobot_small")
FRICTION = load_robot("acrobot_large")

COUNT = 1000
SHARE = 5.0 / np.sqrt(COUNT)
"""Five standard errors of a mean or a correlation of so many draws; of a variance, with sqrt 2."""


def values(robot):
    return [robot.platform.mass, *robot.cables[0].exit_point[:2], robot.stiffness()[3]]


def test_draws_have_the_mean_and_the_covariance():
    names = ("mass", "C1.exit_point.x", "C1.exit_point.y", "C4.stiffness")
    std = np.array([0.01, 1e-3, 2e-3, 5e3])
    correlation = np.eye(4)
    correlation[0, 1] = correlation[1, 0] = 0.8
    correlation[2, 3] = correlation[3, 2] = -0.5
    doubt = ParameterCovariance(names, correlation * np.outer(std, std))
    found = np.array([values(each) for each in drawn_robots(ROBOT, COUNT, doubt, 7)])
    z = (found - values(ROBOT)) / std
    assert np.abs(z.mean(axis=0)).max() < SHARE
    assert np.abs(z.T @ z / COUNT - correlation).max() < np.sqrt(2.0) * SHARE


def test_a_robot_is_the_same_whatever_the_count_and_differs_by_seed():
    doubt = ParameterCovariance.independent({"mass": 0.01, "C2.anchor_point.z": 1e-3})
    masses = [each.platform.mass for each in drawn_robots(ROBOT, 5, doubt, 1)]
    assert [each.platform.mass for each in drawn_robots(ROBOT, 3, doubt, 1)] == masses[:3]
    assert len({*masses, drawn_robots(ROBOT, 1, doubt, 2)[0].platform.mass}) == 6
    assert ROBOT.platform.mass == load_robot("acrobot_small").platform.mass


def test_every_parameter_changes_its_own_and_nothing_else():
    for robot in (ROBOT, FRICTION):
        before = packed(robot)
        for name in parameter_names(robot):
            changed = packed(changed_robot(robot, {name: 1e-6}))
            assert any(changed[key] != before[key] for key in before), name
        assert packed(changed_robot(robot, {})) == before
        assert packed(changed_robot(robot, {"C1.length_offset": 1.0, "clock": 0.1})) == before


def packed(robot):
    """All that parameters change, as numbers."""
    cables, drum = robot.cable_set(), robot.drum()
    friction = robot.winch.friction
    return {
        "cables": cables.packed().tolist(),
        "inertia": platform_inertia(robot).CopyToFullMatrix6().tolist(),
        "drum": np.asarray(drum.radius).tolist(),
        "friction": None if friction is None else vars(friction).copy(),
    }


def test_changes_have_the_size_that_they_say():
    name = ROBOT.cables[0].name
    changed = changed_robot(
        ROBOT,
        {
            "mass": 0.1, "center_of_mass.z": 0.01, "inertia.xy": 1e-5, f"{name}.stiffness": 1e3,
            "all.stiffness": 500.0, f"{name}.exit_point.z": 0.02, f"{name}.pulley_radius": 1e-3,
            f"{name}.length_scale": 0.1, "common_drum_radius": 1e-3, "common_length_scale": 0.01,
            "common_length_offset": 0.03,
        },
    )  # fmt: skip
    assert changed.platform.mass == ROBOT.platform.mass + 0.1
    assert changed.center_of_mass()[2] == pytest.approx(ROBOT.center_of_mass()[2] + 0.01)
    assert changed.platform.inertia[3] == pytest.approx(1e-5)
    assert changed.stiffness()[:2] - ROBOT.stiffness()[:2] == pytest.approx([1500.0, 500.0])
    assert changed.exit_points()[2, 0] - ROBOT.exit_points()[2, 0] == pytest.approx(0.02)
    assert changed.cable_set().pulley_radius[0] == pytest.approx(ROBOT.pulley.radius + 1e-3)
    radius = ROBOT.winch.drum_radius
    assert changed.cables[0].drum_radius == pytest.approx(1.1 * 1.01 * radius + 1e-3)
    assert changed.cables[1].drum_radius == pytest.approx(1.01 * radius + 1e-3)


def test_friction_of_winches_changes_the_one_law_by_their_mean():
    first, second = (cable.name for cable in FRICTION.cables[:2])
    m = len(FRICTION.cables)
    changed = changed_robot(FRICTION, {f"{first}.coulomb": 0.1, f"{second}.coulomb": 0.3})
    grown = changed.winch.friction.coulomb - FRICTION.winch.friction.coulomb
    assert grown == pytest.approx(0.4 / m)


def test_what_no_robot_can_have_is_drawn_again_and_else_refused():
    mass = ROBOT.platform.mass
    wide = ParameterCovariance.independent({"mass": mass})
    masses = np.array([each.platform.mass for each in drawn_robots(ROBOT, 200, wide)])
    assert masses.min() > 0.0
    assert masses.min() < 0.5 * mass
    never = ParameterCovariance.independent({"all.retardation_time": 1e9})  # 0 to 1 s are accepted
    with pytest.raises(DataFileError, match=r"none possible of 1000 .* C1\.retardation_time"):
        drawn_robots(ROBOT, 1, never)


def test_files_of_fits_and_results(tmp_path):
    names, C = ["mass", "C1.length_offset", "C1.exit_point.x"], np.diag([1e-4, 1.0, 1e-6])
    content = {"parameters": [{"name": name} for name in names], "covariance": C.tolist()}
    file = tmp_path / "results.json"
    file.write_text(json.dumps(content))
    doubt = ParameterCovariance.of(tmp_path)
    assert doubt.names == tuple(names)
    assert doubt.of_the_robot().names == ("mass", "C1.exit_point.x")
    one = drawn_robots(ROBOT, 1, file, 3)[0]
    assert one.platform.mass == drawn_robots(ROBOT, 1, doubt, 3)[0].platform.mass
    content["covariance"][2][2] = None
    file.write_text(json.dumps(content))
    with pytest.raises(DataFileError, match=r"C1\.exit_point\.x that is not finite"):
        ParameterCovariance.of(file)
    file.write_text("{}")
    with pytest.raises(DataFileError, match="found no parameters with a covariance"):
        ParameterCovariance.of(tmp_path)
    with pytest.raises(DataFileError, match=r"accepted: results\.json of cdpr calibrate"):
        ParameterCovariance.of(tmp_path / "nowhere")


def test_wrong_covariances_and_names_are_named():
    with pytest.raises(DataFileError, match="not symmetric"):
        ParameterCovariance(("mass", "clock"), np.array([[1.0, 0.5], [0.1, 1.0]]))
    with pytest.raises(DataFileError, match="found one twice"):
        ParameterCovariance(("mass", "mass"), np.eye(2))
    doubt = ParameterCovariance(("mass", "C1.stiffness"), np.array([[1.0, 2.0], [2.0, 1.0]]))
    with pytest.raises(DataFileError, match="variance -1"):
        doubt.factor()
    with pytest.raises(RobotFileError, match=r"parameter 'C9\.stiffness' of acrobot_small"):
        drawn_robots(ROBOT, 1, ParameterCovariance.independent({"C9.stiffness": 1.0}))
