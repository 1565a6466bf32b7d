"""The study of stability ranges: its questions, what it finds, that it runs, stops and writes."""

from __future__ import annotations

import json
import math
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession, WorkProgress
from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.studies.stability_ranges import robot_limits
from cdpr_drake.analyses.studies.stability_ranges import study as module
from cdpr_drake.analyses.studies.stability_ranges.answers import NESTED, falls
from cdpr_drake.analyses.studies.stability_ranges.figures import FIGURES
from cdpr_drake.analyses.studies.stability_ranges.item import (
    PLANAR_ROBOT,
    SECTIONS,
    RangeRow,
    bisected,
)
from cdpr_drake.analyses.studies.stability_ranges.planar_statements import CHECKS as PLANAR_CHECKS
from cdpr_drake.analyses.studies.stability_ranges.robot_limits import (
    LimitedRobot,
    RangeSearch,
    RobotLimits,
    camera_at,
)
from cdpr_drake.analyses.studies.stability_ranges.robots import PLANAR_OTHERS, SPATIAL_OTHERS
from cdpr_drake.analyses.studies.stability_ranges.single_errors import FULL_VOLUME, KNOWN, NO_TURN
from cdpr_drake.analyses.studies.stability_ranges.single_statements import CHECKS as SINGLE_CHECKS
from cdpr_drake.analyses.studies.stability_ranges.spatial_statements import CHECKS as SPATIAL_CHECKS
from cdpr_drake.analyses.studies.stability_ranges.study import (
    StabilityRangesStudy,
    range_items,
    range_statements,
    study_stability_ranges,
)
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.stability.criterion_closed_forms import planar_margin

STEP = 0.01
"""Resolution of the limits that these tests look for [m]."""


@pytest.fixture(scope="module")
def quick() -> StabilityRangesStudy:
    """The quick form."""
    return study_stability_ranges(quick=True, session=StudySession(workers=1))


def test_bisection_finds_the_last_multiple() -> None:
    assert bisected(lambda x: x < 0.735, 2.0, 0.01) == pytest.approx(0.73)
    assert bisected(lambda x: True, 2.0, 0.01) == 2.0
    assert bisected(lambda x: False, 2.0, 0.01) == 0.0


@pytest.mark.parametrize("quick_form", [False, True])
def test_items_have_names_of_their_own_and_pickle(quick_form: bool) -> None:
    items = range_items(quick_form)
    assert len({item.name for item in items}) == len(items)
    assert all(" " not in item.name and "/" not in item.name for item in items)
    assert {item.section for item in items} == set(SECTIONS)
    for item in items:
        assert pickle.loads(pickle.dumps(item)).name == item.name


def test_limits_of_the_object_alone_are_those_of_the_closed_form() -> None:
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


def test_samples_lie_within_limits_and_on_their_edges() -> None:
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


def test_mirrored_places_stand_for_all() -> None:
    limits = replace(PLANAR_OTHERS, place=0.4, r_bp=0.05)
    for r_bp in (0.04, 0.05, 0.06, 0.07):
        some = RangeSearch(LimitedRobot("planar", mirrored=True))
        every = RangeSearch(LimitedRobot("planar"))
        assert some.stable(replace(limits, r_bp=r_bp)) == every.stable(replace(limits, r_bp=r_bp))


def test_larger_limits_are_not_easier() -> None:
    robot = LimitedRobot("planar", camera_at(0.03, 0.0, 20.0), coarse=True)
    names = ("place", "error", "r_B", "r_pc", "d_theta_pc", "r_s", "d_theta_bp")
    reference = RangeSearch(robot).largest(PLANAR_OTHERS, ("r_bp",), 0.4, STEP)
    assert 0.0 < reference < 0.4
    for name in names:
        more = PLANAR_OTHERS.varied((name,), 2.0 * getattr(PLANAR_OTHERS, name))
        assert RangeSearch(robot).largest(more, ("r_bp",), 0.4, STEP) <= reference
    certified = RangeSearch(robot, "certified").largest(PLANAR_OTHERS, ("r_bp",), 0.4, STEP)
    assert certified <= reference


def test_quick_form_answers_everything(quick: StabilityRangesStudy, tmp_path: Path) -> None:
    assert not quick.interrupted
    assert len(quick.statements) == sum(map(len, (PLANAR_CHECKS, SPATIAL_CHECKS, SINGLE_CHECKS)))
    assert quick.tables()
    quick.write(tmp_path)
    assert {path.stem for path in tmp_path.glob("*.png")} == set(FIGURES)
    read = json.loads((tmp_path / "results.json").read_text())
    assert len(read["rows"]) == len(quick.rows)
    assert len(read["statements"]) == len(quick.statements)
    for row in quick.rows:
        if {"sampled", "searched"} <= set(row.answers):
            assert row.answers["searched"] <= row.answers["sampled"]
        if {"certified", "searched"} <= set(row.answers):
            assert row.answers["certified"] <= row.answers["searched"]


def test_published_numbers(quick: StabilityRangesStudy) -> None:
    by_name = {row.name: row for row in quick.rows}
    assert by_name["planar-I"].found == pytest.approx(2.0, abs=2e-3)
    assert 6.0 <= by_name["planar-II-5-0.5-0.3"].found < 8.0
    assert 61.0 <= by_name["planar-II-0.5-0.3-0.2"].found < 65.0
    full = by_name["single-r_pc-0.2"].answers["sampled"]
    assert full == pytest.approx(FULL_VOLUME, abs=1e-3)
    assert by_name["single-r_pc-1"].answers["certified"] == full
    assert by_name["single-d_theta_pc_deg-40"].answers["searched"] == full
    assert 0.2 * full < by_name["single-d_theta_pc_deg-55"].answers["sampled"] < 0.7 * full
    assert by_name["single-d_theta_pc_deg-65"].answers["sampled"] == 0.0
    turned = by_name["single-d_theta_s_deg-90"].answers
    assert turned["sampled"] == 0.0
    assert turned[NO_TURN] == turned[KNOWN] == full


def test_statements_follow_from_the_rows(quick: StabilityRangesStudy) -> None:
    found = {statement.words: statement.verdict for statement in quick.statements}
    first = next(words for words in found if words.startswith("Planar III i:"))
    assert found[first] == CONFIRMED
    second = next(words for words in found if words.startswith("Planar III ii:"))
    assert found[second] == NOT_CONFIRMED
    features = next(words for words in found if "feature vector" in words)
    assert found[features] == IN_PART
    # Other rows, another verdict.
    rows = [
        replace(row, answers={"searched": row.limits["place"]})
        if row.name.startswith("planar-III-place") and "place" in row.limits
        else row
        for row in quick.rows
    ]
    again = {statement.words: statement.verdict for statement in range_statements(rows)}
    assert again[first] != CONFIRMED
    assert range_statements([]) == []


def test_orders_that_hold_by_construction_say_so() -> None:
    rows = [
        RangeRow(
            name=f"r{k}", section=PLANAR_ROBOT, group=group, limits={}, sought="r_bp", unit="m",
            published=None, answers={"searched": 0.2 - 0.1 * k},
        )
        for group in ("place", "r_B")
        for k in range(2)
    ]  # fmt: skip
    statements = range_statements(rows)
    assert [statement.verdict for statement in statements] == [CONFIRMED, CONFIRMED]
    assert all(statement.why == NESTED for statement in statements)


def test_falls() -> None:
    assert falls([3.0, 2.0, 2.0])
    assert not falls([2.0, 2.0])
    assert not falls([3.0, 1.0, 2.0])


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some quick questions."""
    monkeypatch.setattr(module, "range_items", lambda quick: range_items(quick)[:8])


def test_a_stopped_study_continues(few: None, tmp_path: Path) -> None:
    seen: list[WorkProgress] = []
    first = study_stability_ranges(
        True,
        StudySession(tmp_path / "s", seen.append, lambda: bool(seen) and seen[-1].done >= 3, 1),
    )
    assert first.interrupted
    assert [row.name for row in first.rows] == [item.name for item in range_items(True)[:3]]
    assert seen[-1].total == 8
    first.write(tmp_path / "s")
    assert first.tables()
    second = study_stability_ranges(True, StudySession(folder=tmp_path / "s", workers=1))
    assert not second.interrupted
    assert second.progress.found == 3
    assert second.rows[:3] == first.rows
    assert len(second.rows) == 8
    third = study_stability_ranges(True, StudySession(folder=tmp_path / "s", workers=1))
    assert third.progress.found == third.progress.total == 8
    assert third.rows == second.rows


def test_a_folder_of_other_questions_is_refused(
    few: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study_stability_ranges(
        True, StudySession(folder=tmp_path / "s", should_stop=lambda: True, workers=1)
    )
    monkeypatch.setattr(robot_limits, "TURN_STEP", 5.0)
    with pytest.raises(OutputFolderError, match="turn step"):
        study_stability_ranges(True, StudySession(folder=tmp_path / "s", workers=1))
