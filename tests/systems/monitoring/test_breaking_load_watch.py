"""Cables beyond their breaking load: remembered, reported, and ending a run only if asked."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.monitoring.tension_watch import BreakingLoadWatch

PROJECTED = ["camera.kind=projected", "duration=0.4"]


def robot_with_load(folder, load):
    """ACROBOT with cables of this breaking load; at the start the tautest pulls 3.6 N."""
    text = robot_file("acrobot_small").read_text()
    path = folder / "acrobot_small.yaml"
    path.write_text(text.replace("cable:\n", f"cable:\n  breaking_load: {load}\n"))
    return f"robot={path}"


def test_ports_are_these():
    watch = BreakingLoadWatch(np.full(3, 10.0), False)
    assert watch.GetInputPort("tensions").size() == 3
    assert watch.GetOutputPort("broken").size() == 3


def test_a_break_is_reported_and_the_run_goes_on(tmp_path):
    result = run_scenario(load_scenario("acrobot_pbvs", [*PROJECTED, robot_with_load(tmp_path, 4)]))
    assert result.outcome == Outcome.TIMEOUT
    broken = summarize(result)["broken_cables"]
    assert len(broken) >= 1
    assert all(0.0 < entry["time_s"] <= 0.4 and entry["cable"].startswith("C") for entry in broken)
    # Found before or when the log shows it.
    log = result.log
    for i in np.where(np.max(log["tensions"], axis=0) > 4.0)[0]:
        first = log["time"][np.argmax(log["tensions"][:, i] > 4.0)]
        assert 0.0 <= result.broken[i] <= first + 2 * result.servo.max_step


def test_it_ends_the_run_where_asked(tmp_path):
    overrides = [*PROJECTED, robot_with_load(tmp_path, 4), "stop.broken_cable=true"]
    result = run_scenario(load_scenario("acrobot_pbvs", overrides))
    assert result.outcome == Outcome.CABLE_BROKEN
    assert result.sim_time < 0.4
    (entry, *_) = summarize(result)["broken_cables"]
    assert entry["time_s"] == pytest.approx(result.sim_time, abs=3 * result.servo.max_step)


def test_strong_cables_do_not_break(tmp_path):
    overrides = [*PROJECTED, robot_with_load(tmp_path, 1000), "stop.broken_cable=true"]
    result = run_scenario(load_scenario("acrobot_pbvs", overrides))
    assert result.outcome == Outcome.TIMEOUT
    assert summarize(result)["broken_cables"] == []


def test_without_a_breaking_load_nothing_can_be_asked():
    assert run_scenario(load_scenario("acrobot_pbvs", PROJECTED)).broken is None
    with pytest.raises(ScenarioError, match=r"stop\.broken_cable: found true; accepted: false"):
        load_scenario("acrobot_pbvs", ["stop.broken_cable=true"])
