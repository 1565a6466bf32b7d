"""The study of the mobile robot: its facts on laps that are made up, corners, margins."""

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.studies.facts import GOOD, facts_of
from cdpr_drake.analyses.studies.mobile_robot import (
    CORNERS,
    PHASES,
    STUDY,
    TENSION_LAPS,
    VARIED,
    VIEWS,
    at_one_place,
    lap_numbers,
    laps_words,
    rise,
    times_beyond,
    view_margin,
    with_friction,
)
from cdpr_drake.analyses.studies.study import Form
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from tests.figure_faults import figure_faults

CASES = list(STUDY.cases(Form()))
SHAPE = {
    "most_slack": 1.0, "seen": 1.0, "path_m": 0.001, "tension_n": 9.0, "estimate_rad": 0.26,
    "one_slack": 0.8, "two_slack": 1.0, "underactuated_s": 1.0, "at_threshold": 1.5,
    "estimate_at": 0.5, "slack_at_estimate": 3.0, "path_at": CORNERS[1] + 0.05,
}  # fmt: skip
"""A lap as the thesis has them."""


def made_up(laps, failed_at=None, high=0.0, growth=0.0, **other):
    """Curves of a run that ends after `failed_at` laps, as the thesis has them."""
    done = laps if failed_at is None else failed_at
    numbers = np.arange(1.0, laps + 1.0)
    there = numbers <= done
    curves = {name: np.where(there, value, np.nan) for name, value in (SHAPE | other).items()}
    far = np.where(there, high * numbers, np.nan)
    sums = np.where(there, 8.5 + growth * (numbers - 1.0), np.nan)
    tensions = np.full((len(TENSION_LAPS) + 1, PHASES, 8), 5.0)
    tensions[:-1][np.array(TENSION_LAPS) > done] = np.nan
    return {
        **curves, "estimate_m": far, "estimate_z_m": far, "tensions_n": tensions,
        "sums_m": np.tile(sums[:, None], (1, PHASES)), "done": float(done),
    }  # fmt: skip


def rows_of(runs):
    """Rows of curves by configuration."""
    keys = {case.keys["configuration"]: case.keys for case in CASES}
    rows = []
    for name, curves in runs.items():
        failed = curves["done"] < len(curves["path_m"])
        rows.append({
            **keys[name], "seed": 0, "failed": failed, "laps_done": curves["done"],
            "underactuated_at_end_s": 6.0 if failed else 0.0,
            "laps_to_failure": curves["done"] if failed else np.inf,
            **lap_numbers(curves, curves["done"]), "arrays": curves,
        })  # fmt: skip
    return pd.DataFrame(rows)


def printed():
    """Runs as the thesis has them."""
    runs = {}
    for case in CASES:
        keys = case.keys
        share = keys["margin_m"] / view_margin(0.30, 0.06)
        laps = None if keys["way"] == "corrected" else share * keys["printed_laps"]
        runs[keys["configuration"]] = made_up(keys["asked_laps"], laps)
    runs["estimator control_integration"] = made_up(30, 12, high=0.025)
    runs["estimator cable_lengths_elastic_pulleys"] = made_up(30, 4, high=0.03)
    runs["plain"] = made_up(60, 29, growth=0.02)
    path = runs["plain"]["path_m"]
    path[15:22], path[22:29] = 0.05, 0.1
    runs["corrected"]["path_m"][0] = 0.005
    return runs


def verdicts(runs):
    rows = rows_of(runs)
    return {
        fact.name: fact.judge(rows, STUDY.finds, {}, "")["verdict"] for fact in facts_of(STUDY.name)
    }


def test_what_is_printed_is_confirmed_and_its_contrary_is_not():
    runs = printed()
    assert verdicts(runs) == {fact.name: GOOD[fact.basis] for fact in facts_of(STUDY.name)}
    for case in CASES:
        keys, laps = case.keys, case.keys["asked_laps"]
        ended = keys["way"] == "corrected" or keys["choice"].startswith("view")
        runs[keys["configuration"]] = made_up(
            laps, 20 if ended else None, estimate_at=np.arange(laps) / laps,
            most_slack=3.0, at_threshold=0.0, one_slack=0.1, two_slack=0.1, underactuated_s=0.0,
        )  # fmt: skip
    runs["corrected"]["tensions_n"][-1] += 5.0
    found = verdicts(runs)
    lacking = {name for name, verdict in found.items() if verdict == "not judged"}
    assert lacking == {"corners"}
    assert {found[name] for name in found.keys() - lacking} <= {"not confirmed", "in part"}
    lasting = {found[name] for name in ("estimators", "integration_lasts", "model_helps")}
    assert lasting == {"not confirmed"}  # to last until the run is stopped is no order


def test_views_without_an_effect_are_not_confirmed():
    runs = printed()
    for case in CASES:
        if case.keys["choice"].startswith("view") and case.keys["estimator"] == 1:
            runs[case.keys["configuration"]] = made_up(30, 12)
    held, _ = STUDY.finds["view_decides"](rows_of(runs))
    assert held == [True, False]  # the laps agree, and no view changes them


@pytest.mark.parametrize(("name", "panels"), [("choices", 2), ("views", 1)])
def test_figures_of_what_the_quick_form_has_not(name, panels):
    figure = STUDY.figures[name](rows_of(printed()))
    assert figure_faults(figure) == []
    assert len(figure.axes) == panels


def test_every_configuration_is_a_scenario_that_is_accepted():
    assert len(CASES) == 7 + 4 * len(VARIED) + 3 * len(VIEWS)
    for case in CASES:
        load_scenario("acrobot_mobile_robot", case.call.args[0])
    assert {case.keys["friction"] for case in CASES} == {0.0, 1.0, 3.0}
    friction = load_robot("acrobot_large").winch.friction
    assert with_friction(3.0).winch.friction.coulomb == 3.0 * friction.coulomb


def test_corners_phases_and_times():
    motion = load_scenario("acrobot_mobile_robot").target.path()
    for k, phase in enumerate(CORNERS):
        x_ahead = motion.at(16.0 * phase).rotation().matrix()[:2, 0]
        heading = np.degrees(np.arctan2(x_ahead[1], x_ahead[0]))
        turned = heading - np.degrees(np.arctan2(*motion.at(0.0).rotation().matrix()[1::-1, 0]))
        assert (turned - 45.0 - 90.0 * k + 180.0) % 360.0 == pytest.approx(180.0, abs=1.0)
    assert at_one_place(np.array([0.2, 0.3, np.nan])) == (
        pytest.approx(0.25), pytest.approx(np.cos(0.1 * np.pi)),
    )  # fmt: skip
    times, beyond = np.arange(5.0), np.array([False, True, True, False, True])
    assert times_beyond(times, beyond).tolist() == [0.0, 1.0, 2.0, 0.0, 1.0]
    assert times_beyond(times, np.ones(5, bool))[-1] == 4.0


def test_margin_of_a_view_is_where_its_corner_leaves_the_image():
    distance, edge = 0.2, 0.06
    servo = build_visual_servo(load_scenario("acrobot_mobile_robot", ["camera.kind=projected"]))
    margin, pinhole = view_margin(distance, edge), servo.pinhole
    corner = np.array([[0.0], [margin + edge / 2.0], [distance]])
    assert pinhole.project(corner)[1, 0] == pytest.approx(pinhole.height, rel=0.01)
    assert view_margin(0.2, 0.09) < margin < view_margin(0.3, 0.06)


def test_words_and_rises():
    runs = pd.DataFrame({"laps_done": [20.0, 4.0, 6.0], "failed": [False, True, True]})
    assert laps_words(runs) == "median 6.0 (4.0 to 20.0), 1 of 3 did not fail"
    sums = made_up(30, 25, growth=0.01)["sums_m"]
    assert rise(sums, 10, 20) == pytest.approx(0.1)
    assert np.isnan(rise(sums, 10, 28))
    assert np.isnan(rise(sums, 10, 40))
