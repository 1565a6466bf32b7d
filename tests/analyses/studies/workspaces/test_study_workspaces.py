"""The study of workspaces: its questions, cross-checks that can fail, that it stops and goes on."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import CONFIRMED, NOT_CONFIRMED
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.workspaces import distances
from cdpr_drake.analyses.studies.workspaces import items as items_module
from cdpr_drake.analyses.studies.workspaces import study as study_module
from cdpr_drake.analyses.studies.workspaces.figures import static_figure
from cdpr_drake.analyses.studies.workspaces.items import (
    ALONE,
    ENDLESS,
    EVERY,
    FIGURE,
    HEAVY,
    ZERO,
    kind_items,
)
from cdpr_drake.analyses.studies.workspaces.statements import CHECKS, workspace_statements
from cdpr_drake.analyses.studies.workspaces.study import study_workspaces
from cdpr_drake.analyses.studies.workspaces.tables import ALL, shares_of
from cdpr_drake.analyses.workspaces.conditions import KINDS
from cdpr_drake.errors import OutputFolderError
from cdpr_drake.models.robot_loader import load_robot

ROBOTS = ("caroca_gazebo", "planar")
"""One that hangs, without the scenario's camera, and one that is planar."""


@pytest.fixture(scope="module", autouse=True)
def few():
    """Two robots and coarse figures."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(items_module, "ROBOTS", ROBOTS)
        patch.setattr(items_module, "QUICK_STEPS", 8.0)
        patch.setattr(study_module, "QUICK_POSES", 4)
        yield


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The quick form, stopped once and continued."""
    folder = tmp_path_factory.mktemp("study")
    seen = []
    first = study_workspaces(
        True, StudySession(folder, seen.append, lambda: bool(seen) and seen[-1].done > 2000, 1)
    )
    assert first.interrupted
    assert first.found
    second = study_workspaces(True, StudySession(folder, workers=1))
    assert second.progress.found == first.progress.done > 2000
    for one, other in zip(first.found, second.found, strict=False):
        assert one.item.name == other.item.name
        for kind, holds in one.holds.items():
            np.testing.assert_array_equal(holds, other.holds[kind])
    return second


def test_it_is_a_study_that_continues():
    assert STUDIES["workspaces"].continues


def test_every_robot_has_every_kind_that_it_can_have(study):
    assert not study.interrupted
    every = {one.item.robot: one for one in study.found if one.item.group == EVERY}
    assert tuple(every) == ROBOTS
    assert set(every["planar"].holds) == set(KINDS)
    assert set(KINDS) - set(every["caroca_gazebo"].holds) == {"target-visible"}
    (left_out,) = study.left_out
    assert (left_out.robot, left_out.kind) == ("caroca_gazebo", "target-visible")
    assert left_out.why.startswith("caroca_pbvs.yaml: camera.mount")


def test_a_kind_that_is_refused_is_left_out_and_named(monkeypatch):
    make = items_module.make_workspace_question

    def refuse(name, kinds, *arguments, **named):
        if "wrench-closure" in kinds:
            raise items_module.CdprError("no closure here")
        return make(name, kinds, *arguments, **named)

    monkeypatch.setattr(items_module, "ROBOTS", ("planar",))
    monkeypatch.setattr(items_module, "make_workspace_question", refuse)
    items, left_out = kind_items(True)
    assert [(one.kind, one.why) for one in left_out] == [("wrench-closure", "no closure here")]
    assert not [item for item in items if item.group == HEAVY]
    (every,) = [item for item in items if item.group == EVERY]
    assert set(every.question.kinds) == set(KINDS) - {"wrench-closure"}


def test_figures_take_the_upper_limit_of_the_robot_file(study):
    own = [
        (one.item.robot, one.item.limits)
        for one in study.found
        if one.item.group == FIGURE and one.item.upper_share == 1.0
    ]
    assert own == [
        ("acrobot_small", (0.0, 60.0)),
        ("acrobot_small", (1.0, 60.0)),
        ("acrobot_large", (0.0, 60.0)),
        ("acrobot_large", (1.0, 60.0)),
        ("caroca", (0.0, 10000.0)),
        ("caroca", (30.0, 10000.0)),
    ]


def test_cross_checks_hold(study):
    statements = workspace_statements(study.found, study.distances)
    assert len(statements) == len(CHECKS)
    for statement in statements[4:]:
        assert statement.verdict == CONFIRMED, statement.words


WRONG = {
    "Static workspaces at a lower limit": (FIGURE, "static", 1),
    "Wrench closure does not depend": (HEAVY, "wrench-closure", 1),
    "Where there is wrench closure": (ENDLESS, "static", 0),
    "Dynamic without acceleration": (ZERO, "dynamic", 0),
    "Wrench-feasible with no wrench": (ZERO, "wrench-feasible", 1),
    "Wrench-feasible and dynamic lie": (EVERY, "dynamic", 1),
    "What two kinds": (ALONE, "stable", 0),
}
"""Statements, and which answers, all turned to 1 or 0, make them fail."""


@pytest.mark.parametrize("words", WRONG)
def test_each_cross_check_can_fail(study, words):
    group, kind, value = WRONG[words]
    wrong = []
    for one in study.found:
        # Of the figures those with the higher lower limit.
        mine = group != FIGURE or one.item.limits[0] > 0.0
        if one.item.group == group and kind in one.holds and mine:
            holds = one.holds | {kind: np.full(one.holds[kind].shape, bool(value))}
            wrong.append(replace(one, holds=holds))
        else:
            wrong.append(one)
    (statement,) = [s for s in workspace_statements(wrong) if s.words.startswith(words)]
    assert statement.verdict == NOT_CONFIRMED


def test_what_is_not_finished_is_not_judged(study):
    some = [one for one in study.found if one.item.group == FIGURE]
    assert len(workspace_statements(some)) == 5
    assert workspace_statements(()) == []


def test_shares_are_those_of_the_poses(study):
    (planar,) = [o for o in study.found if o.item.group == EVERY and o.item.robot == "planar"]
    shares = shares_of(planar)
    assert shares["wrench-closure"] == np.mean(planar.holds["wrench-closure"]) > 0.3
    assert shares[ALL] <= min(shares[kind] for kind in planar.holds)
    assert planar.volume(np.ones(planar.item.question.grid.size, bool)).share == 1.0
    assert planar.volume(planar.holds["static"]).unit == "m^2"


def test_it_writes_numbers_and_figures(study, tmp_path):
    study.write(tmp_path, ("svg",))
    told = json.loads((tmp_path / "results.json").read_text())
    assert told["figures"][0]["frame_m3"] == pytest.approx(1.2**3)
    pairs = told["kinds"]["planar"]["pose_shares_of_pairs"]
    assert pairs["static"]["static"] == told["kinds"]["planar"]["pose_shares"]["static"]
    assert pairs["static"]["stable"] == pairs["stable"]["static"]
    assert {path.name for path in tmp_path.iterdir()} == {
        "results.json", "static_acrobot.svg", "static_caroca.svg", "kinds.svg", "pairs.svg",
    }  # fmt: skip
    assert len(study.tables()) == 3


def test_the_figure_of_the_thesis_has_its_panels(study):
    some = [one for one in study.found if one.item.group == FIGURE and one.item.upper_share == 1.0]
    figure = static_figure([one for one in some if one.item.robot != "caroca"], "1.17")
    titles = [axes.get_title().splitlines()[0] for axes in figure.axes]
    assert titles == [
        "acrobot_small, 0 to 60 N", "acrobot_small, 1 to 60 N",
        "acrobot_large, 0 to 60 N", "acrobot_large, 1 to 60 N",
    ]  # fmt: skip


def test_a_folder_of_other_questions_is_refused(tmp_path, monkeypatch):
    folder = tmp_path / "s"
    monkeypatch.setattr(items_module, "PUBLISHED_LOWER", {})
    study_workspaces(True, StudySession(folder, should_stop=lambda: True, workers=1))
    monkeypatch.setattr(items_module, "FORCE_SHARE", 0.2)
    with pytest.raises(OutputFolderError):
        study_workspaces(True, StudySession(folder, workers=1))


@pytest.mark.parametrize("robot", distances.ROBOTS)
def test_clearances_are_those_of_drake_s_queries(robot):
    """The short form of what the study does at 1e4 poses."""
    found = distances.DistanceTask(robot)(0, 12)
    assert not np.any(found["wrong"])
    assert 0.0 < np.max(found["differences"]) < distances.SAME


def test_a_wrong_distance_is_noticed(monkeypatch):
    exact = distances.clearances
    monkeypatch.setattr(distances, "clearances", lambda *args: exact(*args) + 1e-5)
    assert np.any(distances.DistanceTask("caroca")(0, 4)["wrong"])


def test_least_squares_find_the_distances_of_drake_where_its_iterations_end():
    robot = load_robot("caroca")
    around = distances.interference_bodies(robot)
    around = replace(around, radius=np.maximum(around.radius, 1e-4))
    position = np.array([0.3, -0.4, 1.2])
    theirs = distances.drake_clearances(around, position, np.eye(3))
    found = distances.least_squares_clearances(around, position, np.eye(3))
    np.testing.assert_allclose(found, theirs, atol=distances.SAME)


def test_a_cable_shorter_than_what_is_left_out_is_not_compared():
    """At this pose of the study a cable of CAROCA is shorter than a beam is thick."""
    found = distances.DistanceTask("caroca")(1992, 1993)
    assert not found["wrong"][0]
