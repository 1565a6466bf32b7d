"""Verdicts on the thesis' statements follow the numbers."""

from dataclasses import replace

import pytest

from cdpr_drake.analyses.reporting import NOT_CONFIRMED
from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART
from cdpr_drake.analyses.studies.tension_methods.statements import judge_statements
from cdpr_drake.analyses.studies.tension_methods.trial import TensionTrial, run_trial
from cdpr_drake.models import load_robot
from cdpr_drake.trajectories import PoseTrajectory


@pytest.fixture(scope="module")
def template():
    home = load_robot("caroca_gazebo").home.transform()
    return run_trial(
        TensionTrial(
            experiment="thesis",
            robot="caroca_gazebo",
            trajectory=PoseTrajectory((home, home), (1.0,)),
            method="linear_program",
            stiffness=100.0,
            damping=100.0,
            duration=0.01,
        )
    )


def made_up(template, experiment, method, gain, **numbers):
    spec = replace(template.spec, experiment=experiment, method=method, stiffness=gain)
    return replace(template, spec=spec, **numbers)


def verdict(runs, words):
    (found,) = [s for s in judge_statements(runs) if words in s.words]
    assert found.found
    return found.verdict


def test_nothing_is_said_about_runs_that_were_not_made(template):
    assert judge_statements([]) == []
    assert judge_statements([template]) == []


@pytest.mark.parametrize(("jump", "expected"), [(4.0, CONFIRMED), (1e-4, NOT_CONFIRMED)])
def test_jumps_of_the_linear_program(template, jump, expected):
    runs = [
        made_up(template, "thesis", "linear_program", gain, largest_jump=jump)
        for gain in (100.0, 800.0, 1200.0)
    ]
    assert verdict(runs, "linear program jump") == expected


@pytest.mark.parametrize(
    ("far", "near", "expected"),
    [(2.0, 2.0, CONFIRMED), (2.0, 0.5, IN_PART), (0.5, 0.5, NOT_CONFIRMED)],
)
def test_quadratic_against_linear_program(template, far, near, expected):
    """The linear program's largest tension as a multiple of the quadratic program's."""
    runs = [
        made_up(template, name, method, gain, largest_tension=tension)
        for name, factor in (("thesis", far), ("step", near))
        for gain in (100.0, 800.0, 1200.0)
        for method, tension in (("quadratic_program", 1.0), ("linear_program", factor))
    ]
    assert verdict(runs, "below that of the linear program") == expected
