"""Grids, bounds and files of bounds, and the task of a scenario as a question of stability."""

import numpy as np
import pytest
from pydrake.math import RollPitchYaw, RotationMatrix

from cdpr_drake.analyses.studies.stability_recipe import recipe_case
from cdpr_drake.analyses.workspaces.pose_grid import make_grid, spans
from cdpr_drake.analyses.workspaces.servo_stability import robot_stability, scenario_view
from cdpr_drake.analyses.workspaces.stability_defaults import load_bounds, workspace_defaults
from cdpr_drake.errors import BoundsFileError, CdprError
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.stability.perturbation_bounds import BASELINE, PLANAR_BASELINE
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.workspaces.pose_grid import grid_by_step
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

RADII = 1e-9


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
    np.testing.assert_allclose(bounds.radii(), wanted.radii(), rtol=RADII)
    assert grid_of(name).size > 1000
    for words in ("1,1,1", "2,2,1" if robot.is_planar() else "2,2,2"):
        assert make_grid(robot, name, spans(words)).size


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


def test_a_box_has_as_many_points_as_the_default_grid():
    robot = load_robot("acrobot_large")
    box = np.array([-0.1, -0.2, 0.1]), np.array([0.1, 0.2, 0.3])
    grid = make_grid(robot, robot, box=box)
    assert grid.shape == make_grid(robot, robot).shape
    np.testing.assert_allclose([grid.lower, grid.upper], box)


def test_a_file_of_bounds_is_read_with_its_units(tmp_path):
    path = tmp_path / "bounds.yaml"
    path.write_text("r_A: 0.01\nd_theta_bp_deg: 90\nexits: common\n")
    bounds = load_bounds(path)
    assert bounds.d_theta_bp == pytest.approx(np.pi / 2)
    assert (bounds.r_A, bounds.exits, bounds.anchors, bounds.r_bp) == (
        0.01, "common", "independent", 0.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("words", "accepted"),
    [
        ("r_A: -0.01\n", r"r_A.*-0\.01.*>= 0 \[m\]"),
        ("d_theta_bp_deg: 200\n", r"d_theta_bp_deg.*200.*<= 180 \[deg\]"),
        ("d_theta_bp: 0.1\n", r"d_theta_bp.*did you mean d_theta_bp_deg\?"),
        ("exits: all\n", "exits.*independent, common, corners"),
        ("r_A: .nan\n", "r_A"),
        (None, "there is no such file"),
    ],
)
def test_bad_bounds_are_refused_with_file_field_and_range(tmp_path, words, accepted):
    path = tmp_path / "bounds.yaml"
    if words is not None:
        path.write_text(words)
    with pytest.raises(BoundsFileError, match=f"bounds.yaml.*{accepted}"):
        load_bounds(path)


ROUNDING = 1e-12
"""Products of a few poses [m, rad]."""


@pytest.mark.parametrize("robot", ["acrobot_large", "caroca"])
@pytest.mark.parametrize("name", ["acrobot_pbvs", "acrobot_hybrid"])
def test_nothing_is_left_to_do_where_the_camera_has_the_desired_view(robot, name):
    task = scenario_view(robot, name)
    scenario = load_scenario(name)
    X_WC = scenario.target.pose.transform() @ scenario.desired.transform().inverse()
    assert task.target is not None
    rows = task.target.rows(X_WC.rotation().matrix()[None], X_WC.translation()[None])
    np.testing.assert_allclose(rows.error, 0.0, atol=ROUNDING)
    np.testing.assert_allclose(rows.theta_u, 0.0, atol=ROUNDING)
    np.testing.assert_allclose(rows.p_CO[0], scenario.desired.position, atol=ROUNDING)
    assert task.lever == "object"


@pytest.mark.parametrize(
    ("robot", "name", "words"),
    [
        ("acrobot_large", "acrobot_moving_tag", "target.motion; accepted: an object that rests"),
        ("acrobot_large", "acrobot_eye_to_hand", "target.carrier platform; accepted: world"),
        ("acrobot_large", "caroca_pbvs", "outside the frame"),
        ("acrobot_large", "acrobot_pbv", "acrobot_pbvs"),
        ("acrobot_large", "acrobot_pick_and_place", "accepted for workspaces: a visual servo"),
    ],
)
def test_what_the_criterion_is_not_about_is_refused(robot, name, words):
    with pytest.raises(CdprError, match=words):
        scenario_view(robot, name)


@pytest.mark.parametrize("robot", ["planar", "acrobot_small"])
def test_a_question_is_about_the_servo_and_the_printed_matrix_is_an_option(robot):
    """The servo's matrix: p_CO turns with w as -w x p_CO = [p_CO]x w, by finite differences."""
    grid = grid_of(robot)
    asked = robot_stability(robot, grid)
    assert asked.case.lever == "object"
    assert robot_stability(robot, grid, printed_matrix=True).case.lever == "error"
    poses = grid.pose_rows(0, 1)
    rows = asked.case.target.rows(RotationMatrix().matrix()[None], poses[0][None, -3:])
    p, step = rows.p_CO[0], 1e-7
    slope = np.column_stack(
        [(RotationMatrix(RollPitchYaw(step * e)).inverse() @ p - p) / step for e in np.eye(3)]
    )
    x, y, z = p
    crossed = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    np.testing.assert_allclose(slope, crossed, atol=1e-6)
    with pytest.raises(CdprError, match=r"printed_matrix: found with ibvs; accepted with: pbvs"):
        robot_stability("acrobot_small", grid, scheme="ibvs", printed_matrix=True)


def test_the_published_recipe_keeps_the_printed_matrix():
    assert recipe_case("planar", "pbvs").lever == "error"
    assert scenario_view("acrobot_small", "acrobot_pbvs").lever == "object"
