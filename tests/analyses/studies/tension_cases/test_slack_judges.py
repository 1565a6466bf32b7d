"""What is said of slack that moves between cables, and of tension management beside tracking."""

import numpy as np
import pytest

from cdpr_drake.analyses.studies.framework.statement import MET_CONSTRUCTION
from cdpr_drake.analyses.studies.tension_cases import case_9_transfer as nine
from cdpr_drake.analyses.studies.tension_cases import tension_tracking
from cdpr_drake.analyses.studies.tension_cases.case_10_estimates import (
    ESTIMATES,
    first_moment,
    last_is_worse,
    position,
)
from cdpr_drake.analyses.studies.tension_cases.case_10_statements import THRESHOLDS
from cdpr_drake.analyses.studies.tension_cases.slack_experiments import CORRECTED, PLAIN, SLACKS_CM
from cdpr_drake.analyses.studies.tension_cases.tension_tracking import (
    DISTURBED,
    STUDY,
    VARIANTS,
    compared,
    usable,
)
from cdpr_drake.stability.criterion import stability_margin
from tests.analyses.studies.made_runs import made_run, made_runs

ROWS = 200

ROUNDING = 1e-12
"""Of an eigenvalue that is zero, of a matrix of numbers about 1 [-]."""

DEVIATIONS = {"E1": 24, "E3": 20, "E5": 40, "E7": 60, "E9": 50, "E2": 24, "E4": 30, "E6": 31,
              "E8": 32, "E10": 45}  # fmt: skip
"""Estimates of case X at the end [mm]."""


def run_of(name, **changed):
    """A run of an experiment as the thesis has it; `changed` replaces traces and metrics."""
    slack = (PLAIN if name in PLAIN else CORRECTED).index(name)
    metres, plain = SLACKS_CM[slack] / 100.0, name in PLAIN
    time = np.linspace(0.0, 10.0, ROWS)
    lengths = np.ones((ROWS, 8))
    if plain:
        lengths[:100, :2] += metres
        lengths[100:, 4:6] += metres
    three = plain and slack > 0
    taut = np.full(ROWS, 4 if three else 8)
    readings = np.tile(THRESHOLDS, (ROWS, 1)) - (30.0 if slack else 0.0)
    spiky = np.abs(np.sin(2.0 * np.pi * time / 10.0)) if three else 0.01 * time
    traces = {
        "time": time, "unstrained_lengths": lengths, "cable_velocities": np.zeros((ROWS, 8)),
        "taut_cables": taut, "jacobian_rank": np.where(taut < 6, 4, 6),
        "stability_margin": np.where(taut < 6, 0.0, 1.0), "image_deviation": spiky,
        "image_path": np.tile([100.0 + slack, 50.0], (ROWS, 1)), "measured_tensions": readings,
    }  # fmt: skip
    metrics = {
        "estimate_end_rad": np.radians(5.0 if name == "E9" else 2.0),
        "estimate_end_m": 1e-3 * DEVIATIONS[name],
    }
    return made_run(name, "timeout", **{**metrics, **traces, **changed})


def runs(*others):
    """All experiments, with others in the place of some."""
    made = {name: run_of(name) for name in (*PLAIN, *CORRECTED)}
    return made_runs({**made, **{run.case: run for run in others}}.values())


@pytest.mark.parametrize(
    ("judge", "contrary"),
    [
        (nine.transferred, [run_of(n, unstrained_lengths=np.ones((ROWS, 8))) for n in PLAIN]),
        (nine.undisturbed, [run_of("E6", unstrained_lengths=np.full((ROWS, 8), 1.1))]),
        (nine.without_slack, [run_of("E1", stability_margin=np.full(ROWS, -0.1))]),
        (nine.three_and_four, [run_of("E3", taut_cables=np.full(ROWS, 6))]),
        # Four for a moment, else none.
        (nine.three_and_four, [run_of("E3", taut_cables=np.where(np.arange(ROWS) == 99, 4, 8))]),
        (nine.rotation, [run_of("E9", estimate_end_rad=0.0)]),
        (nine.two_spikes, [run_of("E7", image_deviation=np.linspace(0.0, 1.0, ROWS))]),
        (last_is_worse, [run_of("E10", estimate_end_m=0.03)]),
        (position, [run_of("E3", estimate_end_m=0.05)]),
        (first_moment, [run_of(n, image_path=np.tile([100.0, 50.0], (ROWS, 1))) for n in PLAIN]),
    ],
)
def test_what_is_published_is_confirmed_and_its_contrary_is_not(judge, contrary):
    assert judge.judge(runs()).verdict == "confirmed"
    assert judge.judge(runs(*contrary)).verdict != "confirmed"


def test_a_criterion_without_rank_fails_by_construction():
    said = nine.no_criterion.judge(runs())
    assert said.verdict == MET_CONSTRUCTION
    wrong = nine.no_criterion.judge(runs(run_of("E9", stability_margin=np.ones(ROWS))))
    assert wrong.verdict == "in part"
    # No matrix with a twist that it leaves out is positive definite.
    rng = np.random.default_rng(0)
    for rank in range(1, 6):
        Pi = rng.normal(size=(6, rank)) @ rng.normal(size=(rank, 6))
        assert stability_margin(Pi) <= ROUNDING


def test_estimates_are_compared_with_and_without_correction():
    assert [judge.judge(runs()).verdict for judge in ESTIMATES] == ["confirmed"] * 4
    assert nine.spikes(np.array([0.0, 1.0, 0.0, 0.1, 0.0, 1.0, np.nan, 0.2])) == 2


GOOD = {"slack_share": 0.0, "image_max_px": 20.0, "camera_max_m": 0.003}


def made_up(changed, outcome=None):
    """Runs of all variants under all sets; by variant, what differs from `GOOD`."""
    runs = []
    for one in DISTURBED:
        for variant in VARIANTS:
            numbers = {**dict.fromkeys(STUDY.cases.metrics(), 1.0), **GOOD}
            numbers |= changed.get(variant, {})
            end = (outcome or {}).get(variant, "converged")
            runs.append(made_run(f"{one}_{variant}", end, **numbers))
    return made_runs(runs)


def test_every_set_is_run_with_every_variant_ten_times_and_more():
    names = {c.name for c in STUDY.cases.configurations}
    assert names == {f"{one}_{variant}" for one in DISTURBED for variant in VARIANTS}
    assert DISTURBED == ("d1", "d2", "d3", "d4")
    assert STUDY.seeds[0] >= 10


def test_what_is_slack_or_does_not_converge_is_not_usable():
    runs = made_up({"none": {"slack_share": 0.9}}, {"printed": "timeout"})
    assert usable(runs, DISTURBED) == ["constant", "distribution", "edge", "middle"]
    assert compared(runs, DISTURBED, "slack_share")["none"] == pytest.approx(0.9)


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"middle": {"image_max_px": 10.0}}, "confirmed"),
        ({}, "in part"),  # none is better
        ({"constant": {"image_max_px": 10.0}}, "not confirmed"),
        ({"middle": {"image_max_px": 10.0, "slack_share": 0.5}}, "in part"),  # not usable
    ],
)
def test_better_is_what_deviates_less_and_is_usable(changed, expected):
    assert tension_tracking._better.judge(made_up(changed)).verdict == expected


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({}, "confirmed"),
        ({"constant": {"camera_max_m": 0.01}}, "in part"),
        ({v: {"slack_share": 0.5} for v in VARIANTS}, "not confirmed"),
    ],
)
def test_correction_and_tracking_go_together(changed, expected):
    assert tension_tracking._combined.judge(made_up(changed)).verdict == expected


@pytest.mark.parametrize(
    ("image", "camera", "expected"),
    [(20.5, 0.003, "confirmed"), (10.0, 0.003, "in part"), (10.0, 0.006, "not confirmed")],
)
def test_a_polygon_is_small_where_its_middle_changes_nothing(image, camera, expected):
    runs = made_up({"middle": {"image_max_px": image, "camera_max_m": camera}})
    assert tension_tracking._small_polygon.judge(runs).verdict == expected
