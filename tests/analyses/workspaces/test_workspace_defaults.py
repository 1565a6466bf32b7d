"""Grids and bounds of the servoing thesis as data, and files of bounds."""

import numpy as np
import pytest

from cdpr_drake.analyses.workspaces.stability_defaults import load_bounds, workspace_defaults
from cdpr_drake.errors import BoundsFileError
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.stability.perturbation_bounds import BASELINE, PLANAR_BASELINE
from cdpr_drake.workspaces.pose_grid import grid_by_step
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

ROUNDING = 1e-9


def grid_of(name):
    defaults = workspace_defaults(load_robot(name), name)
    return grid_by_step(defaults.lower, defaults.upper, defaults.step)


@pytest.mark.parametrize(
    ("name", "shape", "size"),
    [
        ("acrobot_small", (33, 33, 12), 1.014),
        ("acrobot_large", (33, 33, 12), 1.014),
        ("acrobot_fully_constrained", (33, 33, 12), 1.014),
        ("caroca", (33, 33, 11), 77.414),  # the largest workspace that the thesis prints
        ("planar", (33, 33, 1), 0.92),
    ],
)
def test_grids_are_those_of_the_thesis(name, shape, size):
    grid = grid_of(name)
    assert grid.shape[1:] == shape
    lengths = grid.upper - grid.lower
    assert np.prod(lengths[lengths > 0.0]) == pytest.approx(size, rel=2e-3)


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_every_robot_has_a_grid_and_bounds(name):
    robot = load_robot(name)
    bounds = workspace_defaults(robot, name).bounds
    wanted = PLANAR_BASELINE if robot.is_planar() else BASELINE
    np.testing.assert_allclose(bounds.radii(), wanted.radii(), rtol=ROUNDING)
    assert grid_of(name).size > 1000


def test_a_robot_of_ones_own_gets_a_grid_in_its_frame(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(robot_file("caroca").read_text())
    (tmp_path / "workspace.yaml").write_text("not: mine")
    robot = load_robot(str(path))
    defaults = workspace_defaults(robot, str(path))
    assert np.all(defaults.lower >= robot.frame.lower)
    assert np.all(defaults.upper < robot.frame.upper)
    assert defaults.bounds == BASELINE
    grid = grid_by_step(defaults.lower, defaults.upper, defaults.step)
    assert grid.shape[1:] == (17, 17, 9)


def test_a_file_of_bounds_is_read_with_its_units(tmp_path):
    path = tmp_path / "bounds.yaml"
    path.write_text("r_A: 0.01\nd_theta_bp_deg: 90\nexits: common\n")
    bounds = load_bounds(path)
    assert bounds.r_A == 0.01
    assert bounds.d_theta_bp == pytest.approx(np.pi / 2)
    assert (bounds.exits, bounds.anchors, bounds.r_bp) == ("common", "independent", 0.0)


@pytest.mark.parametrize(
    ("words", "accepted"),
    [
        ("r_A: -0.01\n", ["r_A", "-0.01", ">= 0 [m]"]),
        ("d_theta_bp_deg: 200\n", ["d_theta_bp_deg", "200", "<= 180 [deg]"]),
        ("d_theta_bp: 0.1\n", ["d_theta_bp", "did you mean d_theta_bp_deg?"]),
        ("exits: all\n", ["exits", "independent, common, corners"]),
        ("r_A: .nan\n", ["r_A"]),
    ],
)
def test_bad_bounds_are_refused_with_file_field_and_range(tmp_path, words, accepted):
    path = tmp_path / "bounds.yaml"
    path.write_text(words)
    with pytest.raises(BoundsFileError) as refused:
        load_bounds(path)
    for word in ["bounds.yaml", *accepted]:
        assert word in str(refused.value)


def test_a_missing_file_of_bounds_is_named(tmp_path):
    with pytest.raises(BoundsFileError, match="there is no such file"):
        load_bounds(tmp_path / "nothing.yaml")
