"""Verbs of motion: plans, runs, studies."""

import json

from matplotlib.figure import Figure

import cdpr_drake as cdpr
from cdpr_drake.analyses.front.session import Session
from cdpr_drake.analyses.planning.robot_path_task import (
    RESERVE,
    make_path,
    path_task,
    robot_limits,
)
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.analyses.front.front_checks import as_json, one_line, shows_itself


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


def test_a_run(tmp_path):
    asked = ["duration=0.2", "integration.engine=compiled"]
    seen = []
    session = Session(on_progress=lambda now: seen.append(now.sim_time))
    found = cdpr.simulate("planar_computed_torque", asked, session=session)
    assert seen
    assert max(seen) <= 0.2
    scenario = load_scenario("planar_computed_torque", asked)
    expected = TensionRun(scenario).simulate().as_dict()
    same = ("outcome", "sim_time_s", "position_error_m", "tension_n")
    assert {k: found.as_dict()[k] for k in same} == {k: expected[k] for k in same}
    assert found.log["tensions"].shape[1] == 4
    assert "outcome" not in shows_itself(found)
    assert isinstance(found.plot(), Figure)
    stopped = cdpr.simulate(scenario, session=Session(should_stop=lambda: True))
    assert stopped.as_dict()["outcome"] == "interrupted"
    one_line(lambda: cdpr.simulate(scenario, video=True), "video")
    one_line(lambda: cdpr.simulate(scenario, log_formats=["xls"]), "log_formats", "xls")
    one_line(lambda: cdpr.finish_run(tmp_path / "none"), "none")
    kept = cdpr.simulate(scenario, folder=tmp_path / "run", formats=("svg",))
    assert kept.failed == {}
    written = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert written == as_json(kept)
    assert (tmp_path / "run" / "error.svg").is_file()
    one_line(lambda: cdpr.simulate(scenario, ["duration=1"]), "overrides")
    one_line(lambda: cdpr.simulate(scenario, seeds=[1, 2]), "seeds")
    one_line(lambda: cdpr.simulate("planar_pbsv"), "planar_pbvs")


def test_runs_over_seeds():
    asked = ["duration=0.2", "camera.kind=projected"]
    found = cdpr.simulate("planar_pbvs", asked, seeds=[3, 5], workers=1)
    assert found.as_dict()["seeds"] == [3, 5]
    assert "2 of 2 runs" in shows_itself(found)
    one_line(lambda: cdpr.simulate("planar_pbvs", asked, seeds=[3, 3]), "different")


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


UNSEEN = ["duration=0.05", "camera.kind=projected", "desired.position=[1.0, 0.0, 0.3]"]
"""A goal outside the frame, from which the camera does not see its target."""


def test_what_nobody_is_told_goes_to_the_log(caplog):
    with caplog.at_level("INFO", "cdpr_drake"):
        cdpr.simulate("planar_pbvs", UNSEEN)
    # Of kernels it is said only where they are not there yet.
    said = [one for one in caplog.records if not one.name.endswith("kernel_cache.first_use")]
    warnings = [one for one in said if one.levelname == "WARNING"]
    assert all(one.name.startswith("cdpr_drake.") for one in warnings)
    told = [one.getMessage() for one in warnings]
    assert ["does not see" in told[0], "outside the frame" in told[1], len(told)] == [True, True, 2]
    assert "building the diagram" in caplog.text
    caplog.clear()
    seen = []
    cdpr.simulate("planar_pbvs", UNSEEN, session=Session(say=seen.append))
    assert [line for line in seen if line.startswith("warning: ")] == [
        f"warning: {x}" for x in told
    ]
    assert caplog.records == []
