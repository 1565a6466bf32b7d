"""What is said of tension management beside tracking, on numbers that were not run."""

import pytest

from cdpr_drake.analyses.studies.tension_cases import tension_tracking
from cdpr_drake.analyses.studies.tension_cases.tension_tracking import (
    DISTURBED,
    STUDY,
    VARIANTS,
    compared,
    usable,
)
from tests.analyses.studies.made_runs import made_run, made_runs

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
