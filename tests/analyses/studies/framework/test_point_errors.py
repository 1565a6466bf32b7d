"""How wrongly a model has the points of its cables: one number for all studies of ACROBOT."""

import pytest

from cdpr_drake.analyses.studies.case_studies import case_1, case_1_ends
from cdpr_drake.analyses.studies.framework.experiments import POINT_ERROR, wrong_points
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.fusion import slack_trials
from cdpr_drake.analyses.studies.tension_cases import case_9, case_9_torque
from cdpr_drake.systems.diagrams.load import load_scenario


@pytest.mark.parametrize("scenario", ["acrobot_open_loop", "acrobot_mobile_robot"])
def test_scenarios_with_manufacturing_errors_have_the_same(scenario):
    wrong = load_scenario(scenario).perturbations
    assert (wrong.exit_points, wrong.anchor_points) == (POINT_ERROR, POINT_ERROR)


@pytest.mark.parametrize("study", [case_9.STUDY, case_9_torque.STUDY])
def test_every_case_with_slack_has_the_same(study):
    for case in study.plan(Form()):
        assert set(wrong_points()) <= set(case.changes), case.name


def test_case_1_and_fusion_have_the_same():
    assert set(case_1_ends.POINTS) == set(wrong_points())
    assert set(wrong_points()) <= set(slack_trials.WRONG)
    following = [case for case in case_1.STUDY.plan(Form()) if case.keys["group"] == case_1.MOVING]
    assert following
    for case in following:
        assert set(wrong_points()) <= set(case.changes), case.name
