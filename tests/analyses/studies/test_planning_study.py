"""The study of planned motions in its quick form, and its benchmark's programs."""

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
from cdpr_drake.analyses.studies.framework.statement import OURS
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.planning.statements import AGREEMENT, MOSTLY, PATH, SWING
from cdpr_drake.analyses.studies.planning.study import STUDY, measure
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_timing import plan_along_path

LOCAL = StudySession(workers=1)


def made_up(case, seed, *, share=1.0, reached=0.99, difference=-0.002, left=0.05, ends=0.5):
    """What would be found of a motion without planning it."""
    kind, curve = case.keys["kind"], np.linspace(0.0, 1.0, 4)
    if kind == PATH:
        return {
            "plan_time_s": 1.0, "convex_time_s": 1.0, "difference": difference, "reached": reached,
            "keeps_limits": share <= 1.0, "tracked_share": share, "largest_position_error_m": 0.0,
            "stations_m": curve, "speed_m_s": curve, "largest_speed_m_s": curve,
        }  # fmt: skip
    if kind == SWING:
        of = {"none": 1e-2, "ZVD": left * 1e-2, "shooting": 1e-5}
        times = {"none": 0.5, "ZVD": 0.6, "shooting": ends}
        return {
            "slowest_hz": 5.0, "way_m": 0.2, "left_m": of, "off_m": of, "end_times_s": times,
            "refused": {}, "slow_m": 1e-3,
        }  # fmt: skip
    rms = 2e-3 if case.keys["steps"] else 5e-3
    return {"rms_m": rms, "largest_m": rms, "failures": 0 if case.keys["steps"] else 7}


def study(quick=False, session=LOCAL, **found):
    return replace(STUDY, measure=partial(made_up, **found))(quick, session)


def test_it_judges_tables_and_draws(tmp_path):
    found = study()
    assert [(one.verdict, one.basis) for one in found.statements] == [("confirmed", OURS)] * 6
    assert [one.of for one in found.statements] == [10, 10, 10, 3, 3, 3]
    assert len(found.tables()) == 4
    assert found.write(tmp_path) == {}
    told = json.loads((tmp_path / "results.json").read_text())
    assert told["parameters"]["seeds"] == list(range(10))
    assert not told["interrupted"]
    assert (tmp_path / "phase_planes.png").is_file()


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("keeps_limits", {"share": 1.01}),
        ("limit_reached", {"reached": 0.96}),
        ("convex_time", {"difference": 0.011}),
        ("swing_left", {"left": 0.11}),
        ("shooting", {"ends": 0.7}),
    ],
)
def test_what_does_not_hold_is_not_confirmed(name, changes):
    said = {one.name: one.verdict for one in study(quick=True, **changes).statements}
    assert said.pop(name) == "not confirmed"
    assert set(said.values()) == {"confirmed"}


def test_a_motion_that_shooting_refuses_and_a_controller_that_fails_hold_in_part():
    def measure(case, seed):
        row = made_up(case, seed)
        if case.name == "swing 2":
            row["left_m"].pop("shooting")
            row |= {"refused": {"shooting": "shooting: no motion, in 9 steps"}}
        return row | ({"failures": 1} if case.keys.get("steps") == 5 else {})

    said = {one.name: one for one in replace(STUDY, measure=measure)(False, LOCAL).statements}
    assert said["shooting"].verdict_words == "in part (2 of 3)"
    assert said["shooting"].found.endswith(": none,  9 steps")
    assert said["foresight"].verdict_words == "in part (2 of 3)"
    assert said["keeps_limits"].verdict == "confirmed"


def test_the_quick_motions_are_what_is_said():
    """A path on the simulated robot, and a motion that is too fast for the cables."""
    path, *_, plain, ahead = (measure(case, 0) for case in few(STUDY.plan(Form(quick=True))))
    assert path["keeps_limits"]
    assert path["tracked_share"] <= 1.0
    assert path["reached"] >= MOSTLY
    assert abs(path["difference"]) <= AGREEMENT
    assert len(path["speed_m_s"]) == len(path["stations_m"])
    assert ahead["rms_m"] < plain["rms_m"]
    assert ahead["failures"] == 0 < plain["failures"]


def few(cases):
    """The first path and the motions that are tracked."""
    return [case for case in cases if case.name.startswith(("path planar", "quintic"))]


def test_a_study_that_is_stopped_says_so():
    stopped = study(True, StudySession(should_stop=lambda: True, workers=1))
    assert stopped.interrupted
    assert stopped.statements == []


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
    places = plan.trajectory.stations[4:-4:4]
    programs = station_programs(task, path, places)
    highs = [linprog(**program, method="highs").x[1] for program in programs]
    ours = plan.largest[4:-4:4]
    np.testing.assert_allclose(np.minimum(ours, 100.0), highs, rtol=1e-6)
