"""Verbs of plans and studies."""

import json

from matplotlib.figure import Figure

import cdpr_drake as cdpr
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.planning.path_timing import plan_along_path
from tests.analyses.verbs.verb_checks import as_json, one_line, shows_itself


def test_a_plan(planar, aside):
    found = cdpr.plan_path(planar, [None, aside], speed=0.5, stations=60)
    task = path_task(planar, robot_limits(planar, speed=0.5), reserve=RESERVE)
    way = make_path(planar, [planar.home.transform(), aside.transform()], "smooth")
    expected = plan_along_path(task, way, 60)
    assert found.solution.duration == expected.duration
    told = as_json(found)
    assert told["duration_s"] == expected.duration
    assert told["arguments"]["speed_m_s"] == 0.5
    assert "waypoints" in shows_itself(found)
    assert isinstance(found.plot(), Figure)
    one_line(lambda: cdpr.plan_path(planar, [None]), "1 poses")
    one_line(lambda: cdpr.plan_path(planar, "no.csv"), "no.csv")


def test_studies(tmp_path):
    assert "worked-examples" in cdpr.studies()
    result = cdpr.run_study("worked-examples", tmp_path / "s", quick=True, workers=1)
    assert "Study worked-examples" in shows_itself(result)
    assert result.plot("trajectory").axes
    one_line(lambda: result.plot("ways"), "ways", "trajectory")
    assert json.loads((tmp_path / "s" / "results.json").read_text()) == as_json(result)
    report = cdpr.reproduce(tmp_path / "r", quick=True, only=["worked-examples"], workers=1)
    assert report.page.is_file()
    assert "report" in shows_itself(report)
    one_line(lambda: cdpr.run_study("case-88"), "case-88")
    one_line(lambda: cdpr.reproduce(tmp_path / "x", only=["case-88"]), "case-88")
