"""The study of stability ranges: its questions, what it finds, that it runs, stops and writes."""

import json
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession, WorkProgress
from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import MET_CONSTRUCTION, judged
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.stability_ranges import question, robot_limits
from cdpr_drake.analyses.studies.stability_ranges import single_errors as single
from cdpr_drake.analyses.studies.stability_ranges.question import found
from cdpr_drake.analyses.studies.stability_ranges.robot_limits import (
    LimitedRobot,
    RangeSearch,
    RobotLimits,
    camera_at,
)
from cdpr_drake.analyses.studies.stability_ranges.robots import PLANAR_OTHERS, SPATIAL_OTHERS
from cdpr_drake.analyses.studies.stability_ranges.study import STUDY, cases
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.stability.criterion_closed_forms import planar_margin
from tests.analyses.studies.made_up_studies import with_figures

STEP = 0.01
"""Resolution of the limits that these tests look for [m]."""


@pytest.fixture(scope="module")
def quick():
    """The quick form, in which every pose is looked at less hard."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(robot_limits, "OPTIONS", replace(robot_limits.OPTIONS, draws=10, searches=1))
        patch.setattr(single, "DRAWS", 100)
        return STUDY(True, StudySession(workers=1))


def test_bisection_finds_the_last_multiple():
    assert question.bisected(lambda x: x < 0.735, 2.0, 0.01) == pytest.approx(0.73)
    assert question.bisected(lambda x: True, 2.0, 0.01) == 2.0
    assert question.bisected(lambda x: False, 2.0, 0.01) == 0.0


@pytest.mark.parametrize("quick_form", [False, True])
def test_questions_pickle_and_are_of_all_sections(quick_form):
    questions = STUDY.plan(Form(quick_form))
    assert {one.keys["section"] for one in questions} == set(question.SECTIONS)
    for one in questions:
        assert " " not in one.name
        assert pickle.loads(pickle.dumps(one)).name == one.name


def test_limits_of_the_object_alone_are_those_of_the_closed_form():
    # With an exact robot and camera the limit is 2 m, whatever the platform and e.
    limits = RobotLimits(place=0.3, psi=30.0, error=1.0)
    found = RangeSearch(LimitedRobot("planar", coarse=True)).largest(limits, ("r_s",), 3.0, STEP)
    assert 2.0 - 2.0 * STEP < found < 2.0 + STEP
    # A turned camera and a shifted one, too: 2 sqrt(cos psi) = 2 sin(psi / 2) |e| + shift.
    psi, e = math.radians(40.0), 0.8
    limit = 2.0 * math.sqrt(math.cos(psi)) - 2.0 * math.sin(psi / 2.0) * e
    assert planar_margin(psi, 2.0 * math.sqrt(math.cos(psi))) == pytest.approx(0.0, abs=1e-12)
    turned = RobotLimits(error=e, d_theta_pc=40.0)
    found = RangeSearch(LimitedRobot("planar")).largest(turned, ("r_pc",), 3.0, STEP)
    assert limit - 2.0 * STEP < found < limit + STEP


def test_samples_lie_within_limits_and_on_their_edges():
    limits = replace(SPATIAL_OTHERS, psi=40.0, phi=20.0, theta=10.0, place=0.2)
    poses, errors = LimitedRobot("acrobot_small").samples(limits)
    assert len(poses) == len(errors) == 9 * 3 * 3 * 7 * 7
    assert np.abs(poses[:, 4:6]).max(axis=0) == pytest.approx([0.2, 0.2])
    assert poses[:, 6] == pytest.approx(0.3)
    lengths = np.linalg.norm(errors, axis=1)
    assert set(np.round(lengths, 12)) == {0.0, limits.error}
    angles = 2.0 * np.degrees(np.arccos(np.abs(poses[:, 0])))
    assert angles.max() < 40.0 + 20.0 + 10.0
    assert angles.min() == pytest.approx(0.0, abs=1e-6)
    planar, _ = LimitedRobot("planar", steps=2, mirrored=True).samples(PLANAR_OTHERS)
    assert planar[:, 4:6].min() == 0.0
    assert planar[:, 1:3] == pytest.approx(0.0)


def test_mirrored_places_stand_for_all():
    limits = replace(PLANAR_OTHERS, place=0.4, r_bp=0.05)
    for r_bp in (0.04, 0.05, 0.06, 0.07):
        some = RangeSearch(LimitedRobot("planar", mirrored=True))
        every = RangeSearch(LimitedRobot("planar"))
        assert some.stable(replace(limits, r_bp=r_bp)) == every.stable(replace(limits, r_bp=r_bp))


def test_larger_limits_are_not_easier():
    robot = LimitedRobot("planar", camera_at(0.03, 0.0, 20.0), coarse=True)
    names = ("place", "error", "r_B", "r_pc", "d_theta_pc", "r_s", "d_theta_bp")
    reference = RangeSearch(robot).largest(PLANAR_OTHERS, ("r_bp",), 0.4, STEP)
    assert 0.0 < reference < 0.4
    for name in names:
        more = PLANAR_OTHERS.varied((name,), 2.0 * getattr(PLANAR_OTHERS, name))
        assert RangeSearch(robot).largest(more, ("r_bp",), 0.4, STEP) <= reference
    certified = RangeSearch(robot, "certified").largest(PLANAR_OTHERS, ("r_bp",), 0.4, STEP)
    assert certified <= reference


def test_quick_form_answers_everything(quick, tmp_path):
    assert not quick.interrupted
    assert len(quick.statements) == len(STUDY.checks) == 21
    assert len(quick.tables()) == len(question.SECTIONS) + 2
    some, drawn = with_figures(quick, "single_errors")
    assert drawn == set(STUDY.figures)
    assert some.write(tmp_path) == {}
    assert {path.stem for path in tmp_path.glob("*.png")} == {"single_errors"}
    told = json.loads((tmp_path / "results.json").read_text())
    assert told["units"]["certified_m"] == "m"
    for run in quick.runs:
        for less, more in (("searched", "sampled"), ("certified", "searched")):
            for unit in ("m", "deg", "m3", "percent"):
                if {f"{less}_{unit}", f"{more}_{unit}"} <= set(run.measured):
                    assert run[f"{less}_{unit}"] <= run[f"{more}_{unit}"]


def test_published_numbers(quick):
    by_name = {run.case: run for run in quick.runs}
    assert found(by_name["planar-I"]) == pytest.approx(2.0, abs=2e-3)
    assert 6.0 <= found(by_name["planar-II-5-0.5-0.3"]) < 8.0
    assert question.published(by_name["planar-II-0.5-0.3-0.2"]) == 61.0
    assert 61.0 <= found(by_name["planar-II-0.5-0.3-0.2"]) < 65.0
    full = by_name["single-r_pc-0.2"][single.SAMPLED]
    assert full == pytest.approx(single.FULL_VOLUME, abs=1e-3)
    assert by_name["single-r_pc-1"]["certified_m3"] == full
    assert by_name["single-d_theta_pc_deg-40"]["searched_m3"] == full
    assert 0.2 * full < by_name["single-d_theta_pc_deg-55"][single.SAMPLED] < 0.7 * full
    assert by_name["single-d_theta_pc_deg-65"][single.SAMPLED] == 0.0
    turned = by_name["single-d_theta_s_deg-90"]
    assert turned[single.SAMPLED] == 0.0
    assert turned[single.NO_TURN] == turned[single.KNOWN] == full


def checked(name):
    return next(check for check in STUDY.checks if check.name == name)


def test_statements_follow_from_the_runs(quick):
    said = {one.name: one.verdict for one in quick.statements}
    assert said["vision_alone"] == MET_CONSTRUCTION
    assert said["camera_turn"] == IN_PART
    assert said["smaller_range"] == CONFIRMED
    assert said["difference_of_errors"] == NOT_CONFIRMED
    assert said["seen_object"] == IN_PART
    # Other runs, another verdict.
    changed = [
        replace(run, measured={"searched_m": run.keys.get("place_m", 0.0)})
        if run.case.startswith("planar-III-place")
        else run
        for run in quick.runs
    ]
    assert checked("smaller_range").judge(Runs(changed)).verdict == NOT_CONFIRMED


def row(case, keys, *values):
    """Runs of a case's group, in which so much was found."""
    return Runs([Run(f"{case}{k}", None, keys, {"searched_m": x}) for k, x in enumerate(values)])


@pytest.mark.parametrize("name", ["smaller_range", "anchor_error", "turn_and_tilt"])
def test_orders_that_hold_by_construction_say_so(name, quick):
    said = next(one for one in quick.statements if one.name == name)
    assert said.verdict == CONFIRMED
    assert said.why == question.NESTED


def test_missing_questions_are_no_verdict():
    (said,) = judged([checked("smaller_range")], Runs([], lambda: STUDY.planned(Form())))
    assert said.found.startswith("runs are missing")


def test_falls():
    assert question.falls(row("r", {}, 3.0, 2.0, 2.0))
    assert not question.falls(row("r", {}, 2.0, 2.0))
    assert not question.falls(row("r", {}, 3.0, 1.0, 2.0))


def test_a_stopped_study_continues(tmp_path):
    few = replace(STUDY, cases=lambda form: list(cases(form))[:8])
    seen: list[WorkProgress] = []
    first = few(
        True, StudySession(tmp_path, seen.append, lambda: bool(seen) and seen[-1].done >= 3, 1)
    )
    assert first.interrupted
    assert len(first.runs) == 3
    assert first.tables()
    second = few(True, StudySession(folder=tmp_path, workers=1))
    assert second.progress.found == 3
    assert second.runs.rows[:3] == first.runs.rows
    assert len(second.runs) == 8


def test_a_folder_of_other_questions_is_refused(tmp_path, monkeypatch):
    few = replace(STUDY, cases=lambda form: list(cases(form))[:2])
    few(True, StudySession(folder=tmp_path, should_stop=lambda: True, workers=1))
    monkeypatch.setattr(robot_limits, "TURN_STEP", 5.0)
    with pytest.raises(OutputFolderError, match="turn_step_deg"):
        few(True, StudySession(folder=tmp_path, workers=1))


CAMERA_PLACES = {
    "in-the-middle": (0.0, 0.0, 0.0), "on-an-edge": (0.055, 0.0, 0.0),
    "turned-45-deg": (0.0, 0.0, 45.0), "turned-90-deg": (0.0, 0.0, 90.0),
}  # fmt: skip


def cameras(**limits):
    """Runs of cameras at these places; `limits` differ from 0.1 m."""
    rows = []
    for name, (x, y, turn) in CAMERA_PLACES.items():
        keys = {
            "section": "3.2.1, planar: analysis III", "group": "camera", "sought": "r_bp",
            "camera_x_m": x, "camera_y_m": y, "camera_turn_deg": turn,
        }  # fmt: skip
        searched = limits.get(name.replace("-", "_"), 0.1)
        rows.append(Run(f"planar-III-camera-{name}", None, keys, {"searched_m": searched}))
    return Runs(rows)


@pytest.mark.parametrize(
    ("limits", "held", "of"),
    [
        ({}, 2, 2),
        ({"turned_45_deg": 0.1002}, 2, 2),  # one step of the search, by its luck
        ({"on_an_edge": 0.098}, 1, 2),
        ({"turned_90_deg": 0.098}, 1, 2),
        ({"on_an_edge": 0.08, "turned_90_deg": 0.12}, 0, 2),
    ],
)
def test_one_step_of_the_search_is_no_effect_of_the_camera(limits, held, of):
    said = checked("planar_camera_place").judge(cameras(**limits))
    assert (said.held, said.of) == (held, of)


def test_cameras_are_compared_by_steps_finer_than_what_counts():
    steps = [one.data.args[4] for one in STUDY.plan(Form()) if one.keys["group"] == "camera"]
    assert len(steps) == 6
    assert max(steps) <= 0.01 * 0.1 / 5.0


@pytest.mark.parametrize(
    ("volumes", "held"),
    [
        ((1.014, 0.514, 0.0), (True, True, True)),
        ((1.014, 0.35, 0.0), (True, False, True)),
        ((0.9, 0.514, 0.0), (False, True, True)),
        ((0.9, 1.014, 0.1), (False, False, False)),
    ],
)
def test_each_part_of_the_turned_camera_can_fail(volumes, held):
    rows = [
        Run(f"single-{k}", None,
            {"section": question.SECTIONS[-1], "group": "d_theta_pc_deg", "sought": "workspace"},
            {single.SAMPLED: volume, "searched_m3": volume, single.LOWER_CORNER: volume})
        for k, volume in enumerate(volumes)
    ]  # fmt: skip
    said = checked("camera_turn").find(Runs(rows))
    assert tuple(said.held) == held
