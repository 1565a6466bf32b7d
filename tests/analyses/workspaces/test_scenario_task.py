"""The task of a scenario as a question of stability."""

import numpy as np
import pytest

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
