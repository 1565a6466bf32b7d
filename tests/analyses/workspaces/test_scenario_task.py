"""The task of a scenario as a question of stability."""

import numpy as np
import pytest
from pydrake.math import RollPitchYaw, RotationMatrix

from cdpr_drake.analyses.front.stability import stability_question
from cdpr_drake.analyses.studies.published.stability_recipe import recipe_case
from cdpr_drake.analyses.workspaces.stability_question import scenario_task
from cdpr_drake.errors import CdprError
from cdpr_drake.systems.diagrams.load import load_scenario

ROUNDING = 1e-12
"""Products of a few poses [m, rad]."""


@pytest.mark.parametrize("robot", ["acrobot_large", "caroca"])
@pytest.mark.parametrize("name", ["acrobot_pbvs", "acrobot_hybrid"])
def test_nothing_is_left_to_do_where_the_camera_has_the_desired_view(robot, name):
    task = scenario_task(robot, name)
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
    ],
)
def test_what_the_criterion_is_not_about_is_refused(robot, name, words):
    with pytest.raises(CdprError, match=words):
        scenario_task(robot, name)


@pytest.mark.parametrize("robot", ["planar", "acrobot_small"])
def test_a_question_is_about_the_servo_and_the_printed_matrix_is_an_option(robot):
    """The servo's matrix: p_CO turns with w as -w x p_CO = [p_CO]x w, by finite differences."""
    asked = stability_question(robot)
    assert asked.case.lever == "object"
    printed = stability_question(robot, printed_matrix=True)
    assert printed.case.lever == "error"
    assert asked.arguments() != printed.arguments()
    poses = asked.grid.pose_rows(0, 1)
    rows = asked.case.target.rows(RotationMatrix().matrix()[None], poses[0][None, -3:])
    p, step = rows.p_CO[0], 1e-7
    slope = np.column_stack(
        [(RotationMatrix(RollPitchYaw(step * e)).inverse() @ p - p) / step for e in np.eye(3)]
    )
    x, y, z = p
    crossed = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    np.testing.assert_allclose(slope, crossed, atol=1e-6)
    with pytest.raises(CdprError, match=r"printed matrix: found with ibvs; accepted with: pbvs"):
        stability_question("acrobot_small", "ibvs", printed_matrix=True)


def test_the_published_recipe_keeps_the_printed_matrix():
    assert recipe_case("planar", "pbvs").lever == "error"
    assert scenario_task("acrobot_small", "acrobot_pbvs").lever == "object"
