"""Stability ranges: limits by search beside closed forms, and what facts say of made-up rows."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest

from cdpr_drake.analyses.studies.facts import facts_of, judged
from cdpr_drake.analyses.studies.stability_ranges import (
    PLANAR_FINE,
    SECTIONS,
    SPATIAL_FINE,
    STUDY,
    LimitedRobot,
    RobotLimits,
    Sought,
    bisected,
    cases,
    failing_sample,
    largest_limit,
    limit_row,
    single_row,
    unit_of_limit,
)
from cdpr_drake.analyses.studies.study import Form, StudyResult
from cdpr_drake.stability.criterion_closed_forms import planar_margin
from tests.figure_faults import figure_faults

STEP = 0.01
"""Resolution of the limits that these tests look for [m]."""


def test_bisection_finds_the_last_multiple():
    assert bisected(lambda x: x < 0.735, 2.0, 0.01) == pytest.approx(0.73)
    assert bisected(lambda x: True, 2.0, 0.01) == 2.0
    assert bisected(lambda x: False, 2.0, 0.01) == 0.0


def test_limits_of_the_object_alone_are_those_of_the_closed_form():
    # With an exact robot and camera the limit is 2 m, whatever the platform and e.
    limits = RobotLimits(place=0.3, psi=30.0, error=1.0)
    largest = largest_limit(LimitedRobot("planar", coarse=True), limits, Sought(("r_s",), 3, STEP))
    assert 2.0 - 2.0 * STEP < largest < 2.0 + STEP
    # A turned camera and a shifted one, too: 2 sqrt(cos psi) = 2 sin(psi / 2) |e| + shift.
    psi, e = math.radians(40.0), 0.8
    limit = 2.0 * math.sqrt(math.cos(psi)) - 2.0 * math.sin(psi / 2.0) * e
    assert planar_margin(psi, 2.0 * math.sqrt(math.cos(psi))) == pytest.approx(0.0, abs=1e-12)
    turned = RobotLimits(error=e, d_theta_pc=40.0)
    largest = largest_limit(LimitedRobot("planar"), turned, Sought(("r_pc",), 3.0, STEP))
    assert limit - 2.0 * STEP < largest < limit + STEP


def test_samples_lie_within_limits_and_on_their_edges():
    limits = replace(SPATIAL_FINE, psi=40.0, phi=20.0, theta=10.0, place=0.2)
    poses, errors = LimitedRobot("acrobot_small").samples(limits)
    assert len(poses) == len(errors) == 9 * 3 * 3 * 7 * 7
    assert np.abs(poses[:, 4:6]).max(axis=0) == pytest.approx([0.2, 0.2])
    assert poses[:, 6] == pytest.approx(0.3)
    assert set(np.round(np.linalg.norm(errors, axis=1), 12)) == {0.0, limits.error}
    angles = 2.0 * np.degrees(np.arccos(np.abs(poses[:, 0])))
    assert angles.max() < 40.0 + 20.0 + 10.0
    assert angles.min() == pytest.approx(0.0, abs=1e-6)
    planar, _ = LimitedRobot("planar", steps=2, mirrored=True).samples(PLANAR_FINE)
    assert planar[:, 4:6].min() == 0.0
    assert planar[:, 1:3] == pytest.approx(0.0)


@pytest.mark.parametrize("r_bp", [0.04, 0.05, 0.06, 0.07])
def test_mirrored_places_stand_for_all(r_bp):
    limits = replace(PLANAR_FINE, place=0.4, r_bp=r_bp)
    mirrored = failing_sample(LimitedRobot("planar", mirrored=True), limits)
    assert (mirrored is None) == (failing_sample(LimitedRobot("planar"), limits) is None)


def test_larger_limits_are_not_easier():
    robot = LimitedRobot("planar", (0.03, 0.0, 20.0), coarse=True)
    sought = Sought(("r_bp",), 0.4, STEP)
    row = limit_row(robot, PLANAR_FINE, sought, "steps")
    assert 0.0 < row["certified_m"] <= row["searched_m"] < 0.4
    for name in ("place", "error", "r_B", "r_pc", "d_theta_pc", "r_s", "d_theta_bp"):
        larger = PLANAR_FINE.varied((name,), 2.0 * getattr(PLANAR_FINE, name))
        assert largest_limit(robot, larger, sought) <= row["searched_m"]


def test_an_object_turned_by_a_right_angle_leaves_nothing_or_everything():
    row = single_row("d_theta_s_deg", 90.0, coarse=True)
    assert row["sampled_m3"] == row["sampled_lower_corner_m3"] == 0.0
    assert row["sampled_no_turn_m3"] == row["sampled_known_object_m3"] == pytest.approx(1.01376)


def constant(keys):
    return 10.0


@cache
def by_closed_form(call):
    return call()


CASES = list(cases(Form()))


def made_up(largest=constant, volume=lambda keys: keys["printed_m3"]):
    """Rows of all combinations: those by closed forms as they are, others with made-up answers."""
    rows = []
    for case in CASES:
        keys, call = case.keys, case.call.func.__name__
        if call == "limit_row":
            unit = unit_of_limit(keys["sought"].partition(",")[0])
            row = {f"searched_{unit}": largest(keys)}
        elif call == "area_row":
            row = {"sampled_percent": 50.0, "searched_percent": 40.0}
        elif call == "single_row":
            row = dict.fromkeys(
                ("sampled_m3", "searched_m3", "certified_m3", "sampled_lower_corner_m3"),
                volume(keys),
            )
        else:
            row = by_closed_form(case.call)
        rows.append({**keys, **row})
    return rows


def shrinking(keys):
    """Less of what is sought, the larger the sum of all limits."""
    return 10.0 - 0.01 * sum(x for name, x in keys.items() if name.endswith(("_m", "_deg")) if x)


def cameras(**limits):
    names = {name.replace(" ", "_"): name for name in CAMERAS}
    changed = {names[name]: limit for name, limit in limits.items()}
    return lambda keys: changed.get(keys.get("camera"), 0.1)


CAMERAS = ("in the middle", "on an edge", "on a corner", "turned 45 deg", "turned 90 deg")

NESTED = (
    "smaller_range", "anchor_error", "rotation_by_place", "rotational_range", "turn_and_tilt",
    "place_error", "place_rotation",
)  # fmt: skip

MADE_UP = [
    *((name, shrinking, "met (by construction)") for name in NESTED),
    *((name, constant, "not confirmed") for name in NESTED),
    ("vision_alone", constant, "met (by construction)"),
    ("combinations", constant, "confirmed"),
    ("object_place", constant, "in part"),
    ("object_turn", constant, "in part"),
    ("difference_of_errors", constant, "not confirmed"),
    ("difference_of_errors", lambda keys: 0.9 * keys["error_m"], "confirmed"),
    ("difference_of_errors", lambda keys: 1.0, "not confirmed"),
    ("difference", constant, "confirmed"),
    ("difference", lambda keys: 1.0, "in part"),
    ("planar_camera_place", cameras(), "confirmed"),
    ("planar_camera_place", cameras(turned_45_deg=0.1002), "confirmed"),  # one step, by luck
    ("planar_camera_place", cameras(on_an_edge=0.098), "in part"),
    ("planar_camera_place", cameras(turned_90_deg=0.098), "in part"),
    ("planar_camera_place", cameras(on_an_edge=0.08, turned_90_deg=0.12), "not confirmed"),
    ("camera_error", constant, "not confirmed"),
    ("camera_error", lambda keys: 9 if (keys["group"], keys["r_pc_m"]) == ("r_pc coarse", 0.05)
     else 10, "confirmed"),
    ("rotation", lambda keys: 46.0, "confirmed"),
    ("rotation", lambda keys: 80.0, "in part"),
    ("rotation", constant, "in part"),
    ("spatial_camera_place", constant, "confirmed"),
    ("spatial_camera_place", lambda keys: 80.0 - 10.0 * keys["r_pc_m"], "in part"),
    ("spatial_camera_place", lambda keys: 80.0 - 100.0 * keys["r_pc_m"], "not confirmed"),
    ("errors_and_rotation", constant, "not confirmed"),
    ("errors_and_rotation", shrinking, "in part"),
    ("errors_and_rotation", lambda keys: 20.0 - (30.0 if keys["sought"] == "psi" else 10.0)
     * (keys["r_bp_m"] + keys["r_pc_m"]), "confirmed"),
]  # fmt: skip


def verdicts(rows):
    facts = judged(facts_of("stability-ranges"), pd.DataFrame(rows), STUDY.finds, {}, "")
    return {fact["name"]: fact["verdict"] for fact in facts}


@pytest.mark.parametrize(("name", "largest", "verdict"), MADE_UP)
def test_facts_on_made_up_limits(name, largest, verdict):
    def answer(keys):
        try:
            return largest(keys)
        except KeyError:  # of another section
            return 1.0

    assert verdicts(made_up(answer))[name] == verdict


def test_heights_are_a_test():
    def answer(keys):
        return shrinking(keys) - (keys["high_m"] == 0.6 and keys["group"].startswith("height"))

    outcome = verdicts(made_up(answer))
    assert outcome["place_error"] == outcome["place_rotation"] == "in part"


VOLUMES = (
    "single_camera_place", "seen_object", "exit_points", "anchor_points", "platform_turn",
    "platform_place",
)  # fmt: skip


def test_printed_volumes_confirm_and_each_part_can_fail():
    outcome = verdicts(made_up())
    assert {outcome[name] for name in VOLUMES} == {"confirmed"}
    assert outcome["camera_turn"] == "met (fitted)"
    outcome = verdicts(made_up(volume=lambda keys: 0.6))
    assert {outcome[name] for name in VOLUMES} == {"not confirmed"}
    assert outcome["camera_turn"] == "in part"
    for turn in (40.0, 55.0, 65.0):
        rows = made_up(volume=lambda keys, turn=turn: (
            0.3 if keys.get("d_theta_pc_deg") == turn else keys["printed_m3"]
        ))  # fmt: skip
        assert verdicts(rows)["camera_turn"] == "in part"


def test_cameras_are_compared_by_steps_finer_than_what_counts():
    steps = [case.call.args[2].step for case in cases(Form()) if case.keys["group"] == "camera"]
    assert len(steps) == 6
    assert max(steps) <= 0.01 * 0.1 / 5.0


@pytest.mark.parametrize("quick", [False, True])
def test_combinations_are_of_all_sections(quick):
    sections = [case.keys["section"] for case in cases(Form(quick))]
    assert set(sections) == set(SECTIONS)
    assert len(sections) == (96 if quick else 237)


def test_tables_and_figures_show_all_sections():
    rows = [{**row, "arrays": None} for row in made_up(shrinking)]
    result = StudyResult(STUDY, Form(), rows, len(rows))
    tables = result.tables()
    assert len(tables) == len(SECTIONS) + 2
    planar = tables[f"{SECTIONS[1]} [m, deg]"].iloc[0]
    assert {"psi 10 deg", "error 0.5 m", "r_B 0.004 m"} <= set(planar["limits"].split(", "))
    assert "place" not in planar["limits"]
    drawings = result.drawings()
    assert set(drawings) == set(STUDY.figures)
    for name, draw in drawings.items():
        assert figure_faults(draw()) == [], name
