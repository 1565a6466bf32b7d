"""Runs of dynamic control: tracking, outcomes, files, and the command."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.simulation.session import RunSession
from cdpr_drake.analyses.simulation.tension_control_run import (
    run_tension_scenario,
    summarize_tension_run,
    tension_pictures,
    write_tension_data,
)
from cdpr_drake.cli.app import main
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_names
from tests.messages import printed

TRACKING = 1e-4
"""Promised distance from a feasible trajectory with the exact model [m]."""


@pytest.mark.parametrize("name", scenario_names("tension_control"))
def test_every_scenario_tracks_its_trajectory(name):
    run = run_tension_scenario(load_scenario(name))
    summary = summarize_tension_run(run)
    assert run.outcome == Outcome.COMPLETED
    if not run.scenario.plant_alone:  # what forces move is off its trajectory
        assert summary["position_error_m"]["max"] < TRACKING
    assert summary["infeasible_steps"] == 0
    low, high = run.scenario.limits()
    assert low - 1e-9 <= summary["tension_n"]["min"]
    assert summary["tension_n"]["max"] <= high


def test_same_scenario_same_bytes(tmp_path):
    scenario = load_scenario("caroca_computed_torque", ["duration=0.3"])
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        run = run_tension_scenario(scenario)
        write_tension_data(tmp_path / folder, run)
    assert write_pictures(tmp_path / "a", tension_pictures(run)) == {}
    for name in ("log.npz", "log.csv", "scenario.yaml"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    again = load_scenario(str(tmp_path / "a" / "scenario.yaml"))
    assert again.trajectory.start.position.tolist() == [0.0, 0.0, 1.0]
    for figure in ("error", "tensions", "cable_lengths", "platform_path"):
        assert (tmp_path / "a" / f"{figure}.png").stat().st_size > 10_000


def test_infeasible_requests_are_counted_and_the_run_goes_on():
    run = run_tension_scenario(
        load_scenario(
            "acrobot_computed_torque",
            ["distribution.limits=[1.0, 6.5]", "trajectory.stretches="
             "[{pose: {position: [0, 0, 0.25]}, duration: 0.4}]", "duration=1.5"],
        )
    )  # fmt: skip
    summary = summarize_tension_run(run)
    assert summary["infeasible_steps"] > 0
    assert summary["outcome"] in ("completed", "diverged")


def test_stop_request():
    seen = []
    scenario = load_scenario("planar_computed_torque")
    run = run_tension_scenario(scenario, RunSession(seen.append, lambda: len(seen) >= 3))
    assert run.outcome == Outcome.INTERRUPTED
    assert run.sim_time == pytest.approx(0.3)
    assert np.all(np.isfinite(run.log["X_WP"]))


def test_command(capsys, tmp_path):
    with pytest.raises(SystemExit) as ended:
        main(["simulate", "planar_computed_torque", "--duration", "0.5", "--json", "--out",
              str(tmp_path / "out")])  # fmt: skip
    assert ended.value.code == 0
    summary = json.loads(printed(capsys).out)
    assert summary["kind"] == "tension_control"
    assert (tmp_path / "out" / "replay.html").exists()


@pytest.mark.parametrize("option", [["--camera", "projected"], ["--video"]])
def test_command_has_no_camera(capsys, tmp_path, monkeypatch, option):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["simulate", "planar_computed_torque", *option])
    assert ended.value.code == 2
    assert "has no camera" in printed(capsys).err
    assert list(tmp_path.iterdir()) == []


def test_a_control_step_that_is_far_too_long_diverges_with_what_was_logged():
    """Gains that a controller of 1 Hz cannot have."""
    scenario = load_scenario(
        "planar_computed_torque",
        ["controller.rate=1", "controller.stiffness=1e6", "distribution.limits=[0, 1e12]"],
    )
    run = run_tension_scenario(scenario)
    assert run.outcome == Outcome.DIVERGED
    assert len(run.log["time"]) >= 1
    json.dumps(summarize_tension_run(run), allow_nan=False)
