"""Verdicts on the thesis' statements follow the numbers."""

from dataclasses import replace

import pytest

from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.studies.tension_methods.statements import evaluate_statements
from cdpr_drake.analyses.studies.tension_methods.trial import Applied, TensionTrial, run_trial
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory


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
    (found,) = [s for s in evaluate_statements(runs) if words in s.words]
    assert found.found
    return found.verdict


def test_nothing_is_said_about_runs_that_were_not_made(template):
    assert evaluate_statements([]) == []
    assert evaluate_statements([template]) == []


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


@pytest.mark.parametrize(
    ("largest", "smallest", "expected"),
    [
        ((267.0, 385.0, 517.0), -1.0, CONFIRMED),
        ((267.0, 267.0, 267.0), -1.0, IN_PART),
        ((267.0, 385.0, 517.0), 1.0, NOT_CONFIRMED),
    ],
)
def test_the_closed_form_is_negative_and_grows(template, largest, smallest, expected):
    """Each verdict can be reached: once the first of them could not."""
    runs = []
    for gain, tension in zip((100.0, 800.0, 1200.0), largest, strict=True):
        run = made_up(
            template, "thesis", "closed_form", gain,
            largest_tension=tension, smallest_tension=smallest,
        )  # fmt: skip
        runs.append(replace(run, spec=replace(run.spec, applied=Applied.PUSHED)))
    assert verdict(runs, "gives negative tensions") == expected


@pytest.mark.parametrize(("error", "expected"), [(1e-3, CONFIRMED), (1e-7, NOT_CONFIRMED)])
def test_a_steady_error_of_the_closed_form_would_be_seen(template, error, expected):
    run = made_up(template, "thesis", "closed_form", 100.0, last_error=error)
    runs = [
        replace(run, spec=replace(run.spec, applied=applied))
        for applied in (Applied.PUSHED, Applied.CUT)
    ]
    assert verdict(runs, "steady-state error") == expected


@pytest.mark.parametrize(
    ("error", "failures", "expected"),
    [(1e-3, 0, CONFIRMED), (1e-9, 0, NOT_CONFIRMED), (1e-9, 5, IN_PART)],
)
def test_instability_at_high_gains_can_be_confirmed(template, error, failures, expected):
    rows = [
        made_up(template, "thesis", "quadratic_program", 100.0, largest_error=1e-6),
        made_up(template, "thesis", "linear_program", 1200.0, largest_error=error),
        made_up(template, "thesis", "quadratic_program", 1500.0, largest_error=error),
        made_up(template, "far_step", "quadratic_program", 1200.0),
    ]
    rows += [
        made_up(template, "slow", "quadratic_program", gain, failures=failures)
        for gain in (100.0, 800.0, 1200.0, 1500.0)
    ]
    assert verdict(rows, "come near instability") == expected
