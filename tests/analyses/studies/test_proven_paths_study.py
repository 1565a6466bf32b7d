"""The study of proven paths: judgements of made rows, RRT* in spaces known by hand, one problem."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.framework.statement import OURS
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.proven_paths.measured import (
    FOUND,
    FREE_FOUND,
    OPEN,
    PARTED,
    measure_free,
)
from cdpr_drake.analyses.studies.proven_paths.problems import SPECS, Spec, scene_of
from cdpr_drake.analyses.studies.proven_paths.sampled_planners import (
    Space,
    along,
    length_of,
    rrt_star,
    shortcut,
)
from cdpr_drake.analyses.studies.proven_paths.statements import FREE, PROBLEM, SAMPLED
from cdpr_drake.analyses.studies.proven_paths.study import STUDY, measure, paths_figure
from tests.figure_faults import figure_faults

LOCAL = StudySession(workers=1)
LINE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])


def made_up(
    case, seed, *, status=FOUND, infeasible=0, bound=1.0, sampled=1.0, free=FREE_FOUND, missed=0
):
    """What would be found of a problem without planning."""
    kind = case.keys["kind"]
    if kind == FREE:
        return {
            "status": free, "duration_s": 5.0, "length_m": 1.1, "infeasible": missed,
            "samples": 100, "free_s": 30.0,
        }  # fmt: skip
    if kind == SAMPLED:
        row = {f"{name}_{what}": value for name in ("rrt", "ompl") for what, value in (
            ("m", sampled), ("infeasible", 3), ("s", 5.0))}  # fmt: skip
        return row | {"looks": 100, "rrt_path_m": LINE}
    found = status == FOUND
    return {
        "status": status, "straight_m": 0.9, "sets": 50, "cut": 0, "inside_percent": 30.0,
        "outside_percent": 60.0, "sets_s": 9.0, "again_s": np.nan, "ends_m": LINE,
        "boxes_m": np.array([[0.5, 0.5, 0.5, 0.1, 0.1, 0.1]]),
        "length_m": 1.01 if found else np.nan, "curve_m": 1.02, "bound_m": bound,
        "duration_s": 9.0, "path_s": 0.4, "judge_s": 1.0, "infeasible": infeasible,
        "samples": 100 if found else 0, "path_m": LINE if found else np.empty((0, 3)),
    }  # fmt: skip


def study(quick=False, session=LOCAL, **found):
    return replace(STUDY, measure=partial(made_up, **found))(quick, session)


def panels_without_path(found):
    """Titles of panels that say that there is no proven path."""
    figure = paths_figure(found.runs)
    assert figure_faults(figure) == []
    return [
        axes.get_title() for axes in figure.axes
        if any(text.get_text() == "no proven path" for text in axes.texts)
    ]  # fmt: skip


def test_scenes_in_which_no_path_is_proven_say_so():
    found = study(status="not connected", sampled=np.nan)
    scenes = [axes for axes in paths_figure(found.runs).axes if axes.get_title()]
    assert len(panels_without_path(found)) == len(scenes) > 0


def test_it_judges_tables_and_draws(tmp_path):
    found = study()
    assert len(SPECS) == 20
    assert [(one.verdict, one.basis) for one in found.statements] == [("confirmed", OURS)] * 6
    assert [one.of for one in found.statements] == [20, 20, 20, 20, 20, 5]
    problems, free, _ = found.tables()
    assert (problems.row_count, free.row_count) == (20, 5)
    assert figure_faults(paths_figure(found.runs)) == []
    assert not panels_without_path(found)
    assert found.write(tmp_path) == {}
    told = json.loads((tmp_path / "results.json").read_text())
    assert told["parameters"]["effort"]["samples"] == 100_000
    assert (tmp_path / "paths.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("changes", "failed"),
    [
        ({"infeasible": 1}, {"feasible"}),
        ({"bound": 1.0101}, {"above_bound"}),
        ({"bound": 0.9}, {"above_bound"}),
        ({"sampled": 0.9}, {"beside_sampling"}),
        ({"free": "refused"}, {"free_motions"}),
        ({"missed": 1}, {"free_motions"}),
    ],
)
def test_what_does_not_hold_is_not_confirmed(changes, failed):
    said = {one.name: one for one in study(**changes).statements}
    assert {name for name, one in said.items() if one.verdict == "not confirmed"} == failed
    assert {one.verdict for name, one in said.items() if name not in failed} == {"confirmed"}


@pytest.mark.parametrize(
    ("status", "settled", "sampled", "finds"),
    [(OPEN, False, 1.0, False), (PARTED, True, np.nan, True), (PARTED, True, 1.0, False)],
)
def test_problems_without_a_path_hold_where_none_exists(status, settled, sampled, finds):
    def measured(case, seed):
        one = case.keys["robot"] == "macarm"
        return made_up(case, seed, **({"status": status, "sampled": sampled} if one else {}))

    said = {one.name: one for one in replace(STUDY, measure=measured)(False, LOCAL).statements}
    assert (said["settled"].verdict == "confirmed") == settled
    assert (said["finds_what_samples_find"].verdict == "confirmed") == finds
    assert ("macarm wall 1" in said["settled"].found) == (not settled)
    assert said["feasible"].of == 14


def space(good):
    return Space(np.zeros(3), np.ones(3), good)


def test_rrt_star_without_obstacles_ends_on_the_straight_line():
    start, goal = np.array([0.1, 0.1, 0.1]), np.array([0.9, 0.8, 0.7])
    free = space(lambda points: np.ones(len(points), bool))
    found = rrt_star(free, start, goal, 300, seed=0)
    straight = np.linalg.norm(goal - start)
    assert length_of(found) < 1.3 * straight
    better = shortcut(free, found, seed=0)
    assert straight * (1.0 - 1e-12) <= length_of(better) < 1.02 * straight
    np.testing.assert_array_equal(better[[0, -1]], [start, goal])
    again = rrt_star(free, start, goal, 300, seed=0)
    np.testing.assert_array_equal(found, again)


def test_rrt_star_goes_round_a_wall_and_nowhere_through_a_whole_one():
    start, goal = np.array([0.1, 0.5, 0.2]), np.array([0.9, 0.5, 0.2])
    most = 2.0 * np.hypot(0.35, 0.4) + 0.1  # over the corners of a wall of height 0.6

    def over(points):
        return (np.abs(points[:, 0] - 0.5) > 0.05) | (points[:, 2] > 0.6)

    found = shortcut(space(over), rrt_star(space(over), start, goal, 800, seed=1), seed=1)
    assert 0.95 * most < length_of(found) < 1.3 * most  # states are looked at, not ways between
    samples = along(found, np.linspace(0.0, length_of(found), 2000))
    assert np.mean(over(samples)) > 0.99
    whole = space(lambda points: np.abs(points[:, 0] - 0.5) > 0.05)
    assert rrt_star(whole, start, goal, 300, seed=0) is None


def test_costs_of_the_tree_are_lengths_of_its_ways():
    """Rewiring passes on what it saves: a longer search is never worse."""
    start, goal = np.array([0.1, 0.5, 0.2]), np.array([0.9, 0.5, 0.2])
    post = space(lambda points: np.linalg.norm(points[:, :2] - 0.5, axis=1) > 0.2)
    lengths = [length_of(rrt_star(post, start, goal, n, seed=3)) for n in (200, 400, 800)]
    assert lengths[0] >= lengths[1] >= lengths[2]


def test_the_quick_problem_is_what_is_said():
    scene = scene_of("caroca", "wall")
    start, goal = scene.ends[0]
    line = start[:3] + np.linspace(0.0, 1.0, 200)[:, np.newaxis] * (goal - start)[:3]
    assert scene.wrong(line) > 0
    assert scene.wrong(np.array([start[:3], goal[:3]])) == 0
    problem, sampled = (measure(case, 0) for case in STUDY.plan(Form(quick=True)))
    assert problem["status"] == FOUND
    assert problem["infeasible"] == 0 < problem["samples"]
    assert problem["straight_m"] < problem["bound_m"] <= problem["length_m"] * (1.0 + 1e-6)
    assert problem["length_m"] <= problem["curve_m"] * (1.0 + 1e-6)
    assert sampled["rrt_m"] >= problem["straight_m"]
    assert [case.keys["kind"] for case in STUDY.plan(Form(quick=True))] == [PROBLEM, SAMPLED]


def test_a_free_motion_is_told_to_stop_after_its_time():
    row = measure_free(Spec("caroca", "wall", 1), -1.0, 10)
    assert row["status"].startswith("stopped after")
    assert row["samples"] == 0


def test_a_study_that_is_stopped_says_so():
    stopped = study(True, StudySession(should_stop=lambda: True, workers=1))
    assert stopped.interrupted
    assert stopped.statements == []
