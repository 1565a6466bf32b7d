"""A few runs of every case study end as the thesis' unperturbed or mild runs do."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.case_studies.case_3 import overshoot, turns
from cdpr_drake.analyses.studies.framework.study import Form
from tests.analyses.studies.made_runs import CASE_STUDIES

ENDS = {
    "case-1": {"a_1": "converged", "a_3": "converged"},
    "case-2": {"within": "converged", "blind_within": "completed"},
    "case-3": {"turned_16": "converged"},
    "case-4": {"none": "converged"},
    "case-5": {"none": "converged"},
    "case-6": {"E1": "converged", "E2": "converged"},
    "case-7": {"d1_servo": "converged", "d1_tracking": "converged"},
    "case-8": {"tracking": "converged"},
    "case-9": {
        "E5": "timeout",
        "E6": "timeout",
        "variant_distribution_pi": "timeout",
        "variant_length": "timeout",
        "stiffness_0.1_corrected": "timeout",
    },
    "case-9-torque": {"torque_8cm_less_30": "timeout"},
    "case-10": {"E5": "timeout", "E8": "timeout"},
    "case-a6": {"camera_E2": "converged"},
    "tension-tracking": {"d2_none": "converged", "d2_middle": "converged"},
}


@pytest.mark.parametrize("case", CASE_STUDIES, ids=lambda case: case.name)
def test_quick_form(case, tmp_path):
    names = {c.name for c in case.cases.configurations}  # which the quick form has all
    assert {one.name for one in case.plan(Form(quick=True))} == names
    short = replace(case, cases=replace(case.cases, quick=tuple(ENDS[case.name])))
    found = short(quick=True, session=StudySession(workers=1))
    ends = {run["configuration"]: run["outcome"] for run in found.runs}
    assert ends == ENDS[case.name]
    if case.name == "case-7":
        found.write(tmp_path)
        assert (tmp_path / "deviations.png").is_file()
        servo, tracking = found.runs["camera_max_m"]
        # The thesis' point: under the same perturbation, tracking deviates several times less.
        assert servo > 2.0 * tracking
    if case.name == "tension-tracking":
        none, middle = found.runs
        assert none["slack_share"] > 0.5
        assert middle["slack_share"] < 0.05
        assert middle["image_max_px"] < none["image_max_px"]


def test_turns_of_a_spiral():
    angle = np.linspace(0.0, 5.0 * np.pi, 200)
    radius = 1.0 + angle
    path = np.column_stack([3.0 + radius * np.cos(angle), -1.0 - radius * np.sin(angle)])
    assert turns(path, np.array([3.0, -1.0])) == pytest.approx(2.5)


def test_overshoot_is_what_lies_beyond_zero():
    time = np.linspace(0.0, 10.0, 1000)
    swinging = np.exp(-0.3 * time) * np.cos(time)  # its lowest point is where tan = -0.3
    lowest = np.pi - np.arctan(0.3)
    expected = -np.exp(-0.3 * lowest) * np.cos(lowest)
    error = np.column_stack([3.0 * swinging, -4.0 * np.exp(-time)])
    error[500] = np.nan
    assert overshoot(error) == pytest.approx(3.0 * expected / 5.0, rel=1e-3)
    assert overshoot(error[:, 1:]) == 0.0
