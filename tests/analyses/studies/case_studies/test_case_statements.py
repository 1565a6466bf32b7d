"""Verdicts of case studies on made-up runs: neither by construction nor too kind."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.case_studies import case_4, case_5, case_a6
from cdpr_drake.analyses.studies.case_studies.case_4 import slower
from cdpr_drake.analyses.studies.framework.case_statements import same_accuracy
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.tension_cases.case_9_statements import least
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.analyses.studies.made_runs import made_run, made_runs


def run(name, outcome="converged", end=None, **metrics):
    """A run that was not made; `end` is where the camera ends beside its goal [m]."""
    place = np.zeros(3) if end is None else np.array(end)
    path = np.array([np.ones(3), place])
    return made_run(name, outcome, camera_path=path, camera_line=np.zeros((2, 3)), **metrics)


@pytest.mark.parametrize(
    ("runs", "expected"),
    [
        ({"none": 0.004, "within": 0.0041}, "not testable"),  # below where runs end
        ({"none": 0.004, "within": 0.012}, "not confirmed"),
        ({"none": 0.001, "beyond": None}, "not testable"),  # one has nothing to compare with
    ],
)
def test_an_accuracy_needs_two_that_converge_and_the_threshold_at_which_runs_end(runs, expected):
    made = [
        run(name, "target_lost") if error is None else run(name, position_error_m=error)
        for name, error in runs.items()
    ]
    assert same_accuracy(tuple(runs), "").judge(made_runs(made)).verdict == expected


@pytest.mark.parametrize(
    ("outcome", "time", "expected"),
    [
        ("converged", 46.0, "confirmed"),
        ("converged", 35.0, "in part"),
        ("target_lost", 46.0, "not confirmed"),
    ],
)
def test_a_run_that_loses_its_target_does_not_converge_later(outcome, time, expected):
    runs = [
        run("none", time_s=31.0), run("within", time_s=33.0), run("beyond", outcome, time_s=time),
        run("beyond_raised", time_s=40.0),
    ]  # fmt: skip
    assert slower.judge(made_runs(runs)).verdict == expected


def test_the_least_of_configurations_that_have_run_unequally_often():
    runs = [run("E1", margin=2.0), run("E1", margin=1.0), run("E2", margin=1.5)]
    assert least(made_runs(runs), ["E1", "E2"], "margin") == 1.0


@pytest.mark.parametrize(
    ("hybrid", "pbvs", "expected"),
    [(5.0, 9.0, "confirmed"), (8.8, 9.0, "in part"), (9.1, 9.0, "not confirmed")],
)
def test_straighter_by_a_hair_is_straighter_in_part(hybrid, pbvs, expected):
    runs = [run("none", image_max_px=hybrid), run("pbvs", image_max_px=pbvs)]
    (check,) = [one for one in case_5.STUDY.checks if one.name == "straighter"]
    said = check.judge(made_runs(runs))
    assert said.verdict == expected
    assert (said.cause == "hardware") == (expected != "confirmed")


@pytest.mark.parametrize(
    ("curved", "outcome", "expected"),
    [
        (30.0, "converged", "confirmed"),
        (250.0, "converged", "in part"),  # stable, but the effect is not small
        (30.0, "target_lost", "not confirmed"),
    ],
)
def test_a_camera_that_is_believed_elsewhere_has_a_small_effect(curved, outcome, expected):
    line = np.array([[100.0, 100.0], [500.0, 400.0]])
    runs = [run("camera_E1", image_max_px=10.0, image_line=line)] + [
        run(f"camera_{name}", outcome, image_max_px=curved, image_line=line)
        for name in ("E2", "E3", "E4")
    ]
    (check,) = [one for one in case_a6.STUDY.checks if one.name == "any_camera"]
    assert check.judge(made_runs(runs)).verdict == expected


def test_case_4_is_judged_with_the_printed_heights_and_shows_raised_ones():
    """Section 2.3.5: from 1.899 m up to a believed 2.202 m."""
    cases = {case.name: case for case in case_4.STUDY.cases(Form())}
    heights = [
        load_scenario("caroca_pbvs", cases[name].changes).initial_pose.position[2]
        for name in ("beyond", "beyond_raised")
    ]
    np.testing.assert_allclose(heights, [1.899, 1.899 + case_4.LIFT], atol=1e-9)
    believed = load_scenario("caroca_pbvs", cases["beyond"].changes).perturbations.initial_pose
    assert believed.position[2] < 2.3
