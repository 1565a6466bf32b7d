"""The study of workspaces: its questions, cross-checks that can fail, that it stops and goes on."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import GOOD, judged
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.workspaces import distances
from cdpr_drake.analyses.studies.workspaces import items as items_module
from cdpr_drake.analyses.studies.workspaces.figures import static_figure
from cdpr_drake.analyses.studies.workspaces.items import (
    ALL,
    ALONE,
    ENDLESS,
    EVERY,
    FIGURE,
    HEAVY,
    ZERO,
    holds_of,
    static,
    study_cases,
)
from cdpr_drake.analyses.studies.workspaces.statements import CHECKS
from cdpr_drake.analyses.studies.workspaces.study import STUDY
from cdpr_drake.analyses.workspaces.conditions import OF_POSES
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
        patch.setattr(items_module, "QUICK_POSES", 4)
        yield


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The quick form, stopped once and continued."""
    folder = tmp_path_factory.mktemp("study")
    seen = []
    stop = StudySession(folder, seen.append, lambda: bool(seen) and seen[-1].done > 2000, 1)
    first = STUDY(True, stop)
    assert first.interrupted
    assert len(first.runs)
    second = STUDY(True, StudySession(folder, workers=1))
    assert second.progress.found == first.progress.done > 2000
    for one, other in zip(first.runs, second.runs, strict=False):
        assert one.case == other.case
        for kind, holds in holds_of(one).items():
            np.testing.assert_array_equal(holds, holds_of(other)[kind])
    return second


def test_every_robot_has_every_kind_that_it_can_have(study):
    assert not study.interrupted
    every = {run["robot"]: run for run in study.runs(group=EVERY)}
    assert tuple(every) == ROBOTS
    assert set(every["planar"]["kinds"]) == set(OF_POSES)
    assert every["planar"]["left_out"] == {}
    assert set(OF_POSES) - set(every["caroca_gazebo"]["kinds"]) == {"target-visible"}
    ((kind, why),) = every["caroca_gazebo"]["left_out"].items()
    assert kind == "target-visible"
    assert why.startswith("caroca_pbvs.yaml: camera.mount")


def test_a_kind_that_is_refused_is_left_out_and_named(monkeypatch):
    make = items_module.make_workspace_question

    def refuse(name, kinds, *arguments, **named):
        if "wrench-closure" in kinds:
            raise items_module.CdprError("no closure here")
        return make(name, kinds, *arguments, **named)

    monkeypatch.setattr(items_module, "ROBOTS", ("planar",))
    monkeypatch.setattr(items_module, "make_workspace_question", refuse)
    by_group = {case.keys["group"]: case for case in study_cases(Form(quick=True))}
    assert HEAVY not in by_group
    assert by_group[EVERY].data == {"wrench-closure": "no closure here"}
    assert set(by_group[EVERY].task.question.kinds) == set(OF_POSES) - {"wrench-closure"}


def test_figures_take_the_upper_limit_of_the_robot_file(study):
    own = [
        (run["robot"], (run["lower_limit_n"], run["upper_limit_n"]))
        for run in study.runs(group=FIGURE, upper_share=1.0)
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
    assert len(study.statements) == len(CHECKS)
    for statement in study.statements[4:]:
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
    for run in study.runs:
        # Of the figures those with the higher lower limit.
        mine = run["group"] == group and (group != FIGURE or run["lower_limit_n"] > 0.0)
        column = f"holds_{kind}"
        if mine and column in run.measured:
            holds = {column: np.full(run[column].shape, bool(value))}
            run = replace(run, measured=run.measured | holds)
        wrong.append(run)
    (check,) = [one for one in CHECKS if one.says.startswith(words)]
    assert check.judge(Runs(wrong)).verdict == NOT_CONFIRMED


def figures_of(study, fine, half):
    """The study's runs where the higher lower limit leaves so much of 1 m^3, by both grids."""
    volumes = {"points_m3": (1.0, fine), "half_points_m3": (1.0, half)}
    return Runs(
        [
            replace(run, measured=run.measured | {
                name: of[int(run["lower_limit_n"] > 0.0)] for name, of in volumes.items()
            })
            for run in study.runs(group=FIGURE)
        ],
        study.runs.planned,
    )  # fmt: skip


@pytest.mark.parametrize("robot", ["acrobot", "caroca"])
@pytest.mark.parametrize(
    ("fine", "half", "expected"),
    [
        (0.907, 0.9065, CONFIRMED),
        (0.907, 0.893, IN_PART),
        (0.894, 0.876, IN_PART),
        (0.894, 0.893, NOT_CONFIRMED),
        (0.8, 0.76, NOT_CONFIRMED),
    ],
)
def test_where_the_grid_decides_whether_a_workspace_remains_large_it_is_said(
    study, robot, fine, half, expected
):
    (check,) = [one for one in CHECKS if one.name == robot]
    good = {CONFIRMED: GOOD[check.basis]}  # CAROCA's rule was changed with its number in sight
    found = check.judge(figures_of(study, fine, half)).verdict
    assert found == good.get(expected, expected)


def test_half_as_many_cells_are_every_second_point(study):
    for run in study.runs(group=FIGURE, upper_share=1.0):
        assert all(n % 2 for n in run["points"])
        inside, weight = static(run)[::2, ::2, ::2].astype(float), run["frame_m3"]
        for _ in range(3):
            inside = np.trapezoid(inside, dx=1.0 / (len(inside) - 1), axis=0)
        assert run["half_points_m3"] == pytest.approx(weight * inside)


def test_what_is_not_finished_is_not_judged(study):
    some = study.runs(group=FIGURE)
    assert len(judged(CHECKS, some, complete=False)) == 5
    assert judged(CHECKS, Runs((), some.planned), complete=False) == []


def test_shares_are_those_of_the_poses(study):
    planar = study.runs.one(group=EVERY, robot="planar")
    shares = planar["pose_shares"]
    assert shares["wrench-closure"] == np.mean(planar["holds_wrench-closure"]) > 0.3
    assert shares[ALL] <= min(shares[kind] for kind in planar["kinds"])


def test_it_writes_numbers_and_figures(study, tmp_path):
    study.write(tmp_path, ("svg",))
    told = json.loads((tmp_path / "results.json").read_text())
    assert told["runs"][0]["frame_m3"] == pytest.approx(1.2**3)
    (planar,) = [one for one in told["runs"] if one["case"] == f"planar, {EVERY}"]
    pairs = planar["pose_shares_of_pairs"]
    assert pairs["static"]["static"] == planar["pose_shares"]["static"]
    assert pairs["static"]["stable"] == pairs["stable"]["static"]
    assert {path.name for path in tmp_path.iterdir()} == {
        "results.json", "runs.csv", "static_acrobot.svg", "static_caroca.svg", "kinds.svg",
        "pairs.svg",
    }  # fmt: skip
    volumes, shares, _ = study.tables()
    assert str(volumes.caption).endswith("Coarse grid: volumes of the full form differ.")
    assert str(shares.caption).endswith("Coarse grid: shares of the full form differ.")


def test_the_figure_of_the_thesis_has_its_panels(study):
    figure = static_figure(study.runs, "1.17", ("acrobot_small", "acrobot_large"))
    titles = [axes.get_title().splitlines()[0] for axes in figure.axes]
    assert titles == [
        "acrobot_small, 0 to 60 N", "acrobot_small, 1 to 60 N",
        "acrobot_large, 0 to 60 N", "acrobot_large, 1 to 60 N",
    ]  # fmt: skip


def test_a_folder_of_other_questions_is_refused(tmp_path, monkeypatch):
    folder = tmp_path / "s"
    monkeypatch.setattr(items_module, "PUBLISHED_LOWER", {})
    STUDY(True, StudySession(folder, should_stop=lambda: True, workers=1))
    monkeypatch.setattr(items_module, "FORCE_SHARE", 0.2)
    with pytest.raises(OutputFolderError):
        STUDY(True, StudySession(folder, workers=1))


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
