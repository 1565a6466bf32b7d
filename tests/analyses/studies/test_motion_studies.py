"""Studies of planned motions, of proven paths and of picking and placing."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.optimize import linprog

from cdpr_drake.analyses.benchmarks.groups import BENCH_GROUPS
from cdpr_drake.analyses.benchmarks.planning import station_programs
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    LimitSettings,
    make_path,
    path_task,
)
from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies import pick_and_place as picking
from cdpr_drake.analyses.studies.framework.statement import OURS
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.planning import statements as planned
from cdpr_drake.analyses.studies.planning import study as planning
from cdpr_drake.analyses.studies.proven_paths import measured as searched
from cdpr_drake.analyses.studies.proven_paths import sampled_planners
from cdpr_drake.analyses.studies.proven_paths import study as proving
from cdpr_drake.analyses.studies.proven_paths.problems import SPECS, Spec, scene_of
from cdpr_drake.analyses.studies.proven_paths.sampled_planners import (
    Space,
    along,
    length_of,
    rrt_star,
    shortcut,
)
from cdpr_drake.analyses.studies.proven_paths.statements import FREE, PROBLEM, SAMPLED
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.pick_and_place.pick_and_place_task import Failure, Phase
from tests.analyses.studies.made_up_studies import made, verdicts
from tests.figure_faults import figure_faults

LINE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])


def motion(case, seed, *, share=1.0, reached=0.99, difference=-0.002, left=0.05, ends=0.5):
    """What would be found of a motion without planning it."""
    kind, curve = case.keys["kind"], np.linspace(0.0, 1.0, 4)
    if kind == planned.PATH:
        return {
            "plan_time_s": 1.0, "convex_time_s": 1.0, "difference": difference, "reached": reached,
            "keeps_limits": share <= 1.0, "tracked_share": share, "largest_position_error_m": 0.0,
            "stations_m": curve, "speed_m_s": curve, "largest_speed_m_s": curve,
        }  # fmt: skip
    if kind == planned.SWING:
        of = {"none": 1e-2, "ZVD": left * 1e-2, "shooting": 1e-5}
        return {
            "slowest_hz": 5.0, "way_m": 0.2, "left_m": of, "off_m": of, "refused": {},
            "end_times_s": {"none": 0.5, "ZVD": 0.6, "shooting": ends}, "slow_m": 1e-3,
        }  # fmt: skip
    rms = 2e-3 if case.keys["steps"] else 5e-3
    return {"rms_m": rms, "largest_m": rms, "failures": 0 if case.keys["steps"] else 7}


def proof(
    case, seed, *, status=searched.FOUND, infeasible=0, bound=1.0, sampled=1.0,
    free=searched.FREE_FOUND, missed=0,
):  # fmt: skip
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
    found = status == searched.FOUND
    return {
        "status": status, "straight_m": 0.9, "sets": 50, "cut": 0, "inside_percent": 30.0,
        "outside_percent": 60.0, "sets_s": 9.0, "again_s": np.nan, "ends_m": LINE,
        "boxes_m": np.array([[0.5, 0.5, 0.5, 0.1, 0.1, 0.1]]),
        "length_m": 1.01 if found else np.nan, "curve_m": 1.02, "bound_m": bound,
        "duration_s": 9.0, "path_s": 0.4, "judge_s": 1.0, "infeasible": infeasible,
        "samples": 100 if found else 0, "path_m": LINE if found else np.empty((0, 3)),
    }  # fmt: skip


MADE_UP = {planning: motion, proving: proof}


def study(module, quick=False, **changes):
    return made(module.STUDY, partial(MADE_UP[module], **changes), quick)


def panels_without_path(found):
    """Titles of scenes, and of panels that say that there is no proven path."""
    figure = proving.paths_figure(found.runs)
    assert figure_faults(figure) == []
    scenes = [axes for axes in figure.axes if axes.get_title()]
    without = [
        axes for axes in scenes if "no proven path" in [text.get_text() for text in axes.texts]
    ]
    return len(without), len(scenes)


@pytest.mark.parametrize(
    ("module", "parts", "figure"),
    [
        (planning, [10, 10, 10, 3, 3, 3], "phase_planes.png"),
        (proving, [20, 20, 20, 20, 20, 5], "paths.png"),
    ],
)
def test_they_are_judged_tabled_and_drawn(module, parts, figure, tmp_path):
    found = study(module)
    assert [(one.verdict, one.basis) for one in found.statements] == [("confirmed", OURS)] * 6
    assert [one.of for one in found.statements] == parts
    assert found.write(tmp_path) == {}
    assert (tmp_path / figure).stat().st_size > 10_000
    told = json.loads((tmp_path / "results.json").read_text())
    assert not told["interrupted"]
    if module is planning:
        assert told["parameters"]["seeds"] == list(range(10))
        assert len(found.tables()) == 4
    else:
        assert told["parameters"]["effort"]["samples"] == 100_000
        assert [table.row_count for table in found.tables()[:2]] == [len(SPECS), 5] == [20, 5]
        assert panels_without_path(found)[0] == 0


def test_scenes_in_which_no_path_is_proven_say_so():
    without, scenes = panels_without_path(study(proving, status="not connected", sampled=np.nan))
    assert without == scenes > 0


@pytest.mark.parametrize(
    ("module", "changes", "failed"),
    [
        (planning, {"share": 1.01}, "keeps_limits"),
        (planning, {"reached": 0.96}, "limit_reached"),
        (planning, {"difference": 0.011}, "convex_time"),
        (planning, {"left": 0.11}, "swing_left"),
        (planning, {"ends": 0.7}, "shooting"),
        (proving, {"infeasible": 1}, "feasible"),
        (proving, {"bound": 1.0101}, "above_bound"),
        (proving, {"bound": 0.9}, "above_bound"),
        (proving, {"sampled": 0.9}, "beside_sampling"),
        (proving, {"free": "refused"}, "free_motions"),
        (proving, {"missed": 1}, "free_motions"),
    ],
)
def test_what_does_not_hold_is_not_confirmed(module, changes, failed):
    said = verdicts(study(module, quick=module is planning, **changes))
    assert said.pop(failed) == "not confirmed"
    assert set(said.values()) == {"confirmed"}


def test_a_motion_that_shooting_refuses_and_a_controller_that_fails_hold_in_part():
    def measure(case, seed):
        row = motion(case, seed)
        if case.name == "swing 2":
            row["left_m"].pop("shooting")
            row |= {"refused": {"shooting": "shooting: no motion, in 9 steps"}}
        return row | ({"failures": 1} if case.keys.get("steps") == 5 else {})

    said = {one.name: one for one in made(planning.STUDY, measure, quick=False).statements}
    assert said["shooting"].verdict_words == said["foresight"].verdict_words == "in part (2 of 3)"
    assert said["shooting"].found.endswith(": none,  9 steps")
    assert said["keeps_limits"].verdict == "confirmed"


@pytest.mark.parametrize(
    ("status", "settled", "sampled", "finds"),
    [
        (searched.OPEN, False, 1.0, False),
        (searched.PARTED, True, np.nan, True),
        (searched.PARTED, True, 1.0, False),
    ],
)
def test_problems_without_a_path_hold_where_none_exists(status, settled, sampled, finds):
    def measure(case, seed):
        one = case.keys["robot"] == "macarm"
        return proof(case, seed, **({"status": status, "sampled": sampled} if one else {}))

    said = {one.name: one for one in made(proving.STUDY, measure, quick=False).statements}
    assert (said["settled"].verdict == "confirmed") == settled
    assert (said["finds_what_samples_find"].verdict == "confirmed") == finds
    assert ("macarm wall 1" in said["settled"].found) == (not settled)
    assert said["feasible"].of == 14


@pytest.mark.parametrize("module", MADE_UP)
def test_a_study_that_is_stopped_says_so(module):
    stopped = module.STUDY(True, StudySession(should_stop=lambda: True, workers=1))
    assert stopped.interrupted
    assert stopped.statements == []


def test_the_quick_motions_are_what_is_said():
    """A path on the simulated robot, and a motion that is too fast for the cables."""
    path, *_, plain, ahead = (
        planning.measure(case, 0)
        for case in planning.STUDY.plan(Form(quick=True))
        if case.name.startswith(("path planar", "quintic"))
    )
    assert path["keeps_limits"]
    assert path["tracked_share"] <= 1.0
    assert path["reached"] >= planned.MOSTLY
    assert abs(path["difference"]) <= planned.AGREEMENT
    assert len(path["speed_m_s"]) == len(path["stations_m"])
    assert ahead["rms_m"] < plain["rms_m"]
    assert ahead["failures"] == 0 < plain["failures"]


def test_the_baseline_of_the_benchmark_asks_the_same_limits():
    """Without limits of speeds the largest (ds/dt)^2 of a station is that of HiGHS."""
    assert "planning" in BENCH_GROUPS
    robot = load_robot("acrobot_large")
    task = path_task(robot, LimitSettings(tensions=(1.0, 60.0), cable_speed=1e3, reserve=RESERVE))
    poses = [
        pose_from_angles(np.array(p), np.zeros(3))
        for p in ([0, 0, 0.2], [0.15, -0.1, 0.4], [-0.1, 0.1, 0.3])
    ]
    path = make_path(robot, poses, "smooth")
    plan = plan_along_path(task, path, 20)
    programs = station_programs(task, path, plan.trajectory.stations[4:-4:4])
    highs = [linprog(**program, method="highs").x[1] for program in programs]
    np.testing.assert_allclose(np.minimum(plan.largest[4:-4:4], 100.0), highs, rtol=1e-6)


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
    np.testing.assert_array_equal(found, rrt_star(free, start, goal, 300, seed=0))


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


def test_the_quick_problem_is_what_is_said(monkeypatch):
    scene = scene_of("caroca", "wall")
    start, goal = scene.ends[0]
    line = start[:3] + np.linspace(0.0, 1.0, 200)[:, np.newaxis] * (goal - start)[:3]
    assert scene.wrong(line) > 0
    assert scene.wrong(np.array([start[:3], goal[:3]])) == 0
    effort = replace(proving.QUICK_EFFORT, boxes=12_000, cells=2**14)
    monkeypatch.setattr(proving, "QUICK_EFFORT", effort)
    cases = proving.STUDY.plan(Form(quick=True))
    assert [case.keys["kind"] for case in cases] == [PROBLEM, SAMPLED]
    monkeypatch.setattr(sampled_planners, "OMPL_SECONDS", 0.5)
    problem, sampled = (proving.measure(case, 0) for case in cases)
    assert problem["status"] == searched.FOUND
    assert problem["infeasible"] == 0 < problem["samples"]
    assert problem["straight_m"] < problem["bound_m"] <= problem["length_m"] * (1.0 + 1e-6)
    assert problem["length_m"] <= problem["curve_m"] * (1.0 + 1e-6)
    assert sampled["rrt_m"] >= problem["straight_m"]


def test_a_free_motion_is_told_to_stop_after_its_time():
    row = searched.measure_free(Spec("caroca", "wall", 1), -1.0, 10)
    assert row["status"].startswith("stopped after")
    assert row["samples"] == 0


def box(distance=1e-3, angle_deg=0.5, failed_in=None, failure=Failure.NONE):
    """A run that set the box down so far off, or failed in a phase."""
    done = failed_in is None
    outcome = Outcome.COMPLETED if done else Outcome.FAILED
    phase = Phase.DONE if done else failed_in
    ended = picking.outcome_of(outcome, phase, failure, distance, float(np.radians(angle_deg)))
    zero = ("offset_x_m", "offset_y_m", "offset_z_m", "time_s", "losses", "unseen_s")
    return ended | dict.fromkeys(zero, 0.0)


BLIND = box(0.3, 20.0, Phase.CARRY, Failure.TAG_NOT_SEEN)


def picked(*rows):
    """The study with these runs in view, two good ones without, and one camera that is blind."""

    def measure(case, seed):
        if case.name == "one camera":
            return BLIND
        return rows[seed % len(rows)] if rows and case.name == picking.CLEAR else box()

    return made(picking.STUDY, measure, seeds=max(len(rows), 2))


@pytest.mark.parametrize(
    ("rows", "verdict"),
    [
        ((box(1.99e-3), box(1e-3, 0.99)), "confirmed"),
        ((box(2.01e-3),), "not confirmed"),
        ((box(1e-3, 1.01),), "not confirmed"),
        ((box(failed_in=Phase.GRASP, failure=Failure.NOT_GRASPED),), "not confirmed"),
        ((box(), BLIND), "in part (1 of 2)"),
    ],
)
def test_boxes_have_to_lie_within_two_millimetres_and_a_degree(rows, verdict):
    statement = picked(*rows).statements[0]
    assert statement.verdict_words == verdict
    if BLIND in rows:
        assert statement.found.startswith("1 of 2; largest 1.00 mm, 0.50 deg; carry: the tag")


def test_numbers_and_a_figure_of_boxes_are_written(tmp_path):
    found = picked()
    assert [one.verdict for one in found.statements] == ["confirmed"] * 4
    assert found.write(tmp_path) == {}
    assert (tmp_path / "set_down.png").stat().st_size > 10_000
    assert set(found.runs.counts("condition")) == set(picking.CONDITIONS)
    assert len(found.tables()) == 2
