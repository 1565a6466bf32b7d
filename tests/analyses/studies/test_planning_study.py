"""The study of planned motions in its quick form, and its benchmark's programs."""

import json

import numpy as np
from scipy.optimize import linprog

from cdpr_drake.analyses.benchmarks.groups import BENCH_GROUPS
from cdpr_drake.analyses.benchmarks.planning import station_programs
from cdpr_drake.analyses.planning.robot_path_task import LimitSettings, make_path, path_task
from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.studies.catalogue import STUDIES
from cdpr_drake.analyses.studies.planning.study import study_planning
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.planning.path_timing import plan_along_path


def test_the_quick_study_confirms_what_is_said(tmp_path):
    assert STUDIES["planning"].continues
    steps = []
    study = study_planning(True, StudySession(tmp_path, steps.append, workers=1))
    assert [statement.verdict for statement in study.statements()] == ["confirmed"] * 6
    assert len(study.paths) == 2
    assert len(steps) == 6
    study.write(tmp_path)
    told = json.loads((tmp_path / "results.json").read_text())
    assert told["parameters"]["seeds"] == [0, 1]
    assert not told["interrupted"]
    assert (tmp_path / "phase_planes.png").is_file()
    assert len(study.tables()) == 4
    again = study_planning(True, StudySession(tmp_path, steps.append, workers=1))
    assert steps[-1].found == 5  # nothing is computed twice
    assert again.statements() == study.statements()
    assert [curve["s"].tolist() for curve in again.curves] == [
        curve["s"].tolist() for curve in study.curves
    ]


def test_a_study_that_is_stopped_says_so():
    study = study_planning(True, StudySession(should_stop=lambda: True, workers=1))
    assert study.interrupted
    assert study.statements() == []


def test_the_baseline_of_the_benchmark_asks_the_same_limits():
    """Without limits of speeds the largest (ds/dt)^2 of a station is that of HiGHS."""
    assert "planning" in BENCH_GROUPS
    robot = load_robot("acrobot_large")
    task = path_task(robot, LimitSettings(tensions=(1.0, 60.0), cable_speed=1e3))
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
