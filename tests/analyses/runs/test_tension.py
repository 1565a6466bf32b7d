"""Runs of dynamic control: tracking, outcomes, files, the command; a summary by hand."""

import json
from importlib.metadata import version

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs.engine import DiagramEngine
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.cli.app import main
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_names
from tests.messages import printed

# Runs of dynamic control: tracking, outcomes, files, and the command.

TRACKING = 1e-4
"""Promised distance from a feasible trajectory with the exact model [m]."""


@pytest.mark.parametrize("name", scenario_names("tension_control"))
def test_every_scenario_tracks_its_trajectory(name):
    """Those that the plant alone can run, up to where the last push or contact ends."""
    alone = load_scenario(name).plant_alone
    short = ["duration=4.0"] if alone else ["integration.engine=compiled"]
    run = TensionRun(load_scenario(name, short)).simulate()
    summary = run.as_dict()
    assert run.outcome == Outcome.COMPLETED
    if not run.scenario.plant_alone:  # what forces move is off its trajectory
        assert summary["position_error_m"]["max"] < TRACKING
    assert summary["infeasible_steps"] == 0
    low, high = run.scenario.limits()
    assert low - 1e-9 <= summary["tension_n"]["min"]
    assert summary["tension_n"]["max"] <= high


def test_same_scenario_same_bytes(tmp_path):
    for folder in ("a", "b"):
        run = cdpr.simulate("caroca_computed_torque", duration=0.3, folder=tmp_path / folder)
    assert run.failed == {}
    for name in ("log.npz", "log.csv", "scenario.yaml"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    again = load_scenario(str(tmp_path / "a" / "scenario.yaml"))
    assert again.trajectory.start.position.tolist() == [0.0, 0.0, 1.0]
    for figure in ("error", "tensions", "cable_lengths", "platform_path"):
        assert (tmp_path / "a" / f"{figure}.png").stat().st_size > 10_000


def test_infeasible_requests_are_counted_and_the_run_goes_on():
    scenario = load_scenario("acrobot_computed_torque", [
        "trajectory.stretches=[{pose: {position: [0, 0, 0.25]}, duration: 0.4}]",
        "distribution.limits=[1.0, 6.5]", "duration=1.5", "integration.engine=compiled",
    ])  # fmt: skip
    summary = TensionRun(scenario).simulate().as_dict()
    assert summary["infeasible_steps"] > 0
    assert summary["outcome"] in ("completed", "diverged")


def test_stop_request():
    seen = []
    scenario = load_scenario("planar_computed_torque")
    run = TensionRun(scenario).simulate(follow=Follow(seen.append, lambda: len(seen) >= 3))
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


def test_a_control_step_that_is_far_too_long_diverges_with_what_was_logged():
    """Gains that a controller of 1 Hz cannot have."""
    scenario = load_scenario(
        "planar_computed_torque",
        ["controller.rate=1", "controller.stiffness=1e6", "distribution.limits=[0, 1e12]"],
    )
    run = TensionRun(scenario).simulate()
    assert run.outcome == Outcome.DIVERGED
    assert len(run.log["time"]) >= 1
    json.dumps(run.as_dict(), allow_nan=False)


# The summary of a run by tensions, against a log that is written by hand.

BY_HAND = 1e-12
"""Metres, radians and newtons, absolute."""

OFF = (0.0, 0.02, 0.01)
TURNED = (0.0, 0.1, 0.3)


@pytest.fixture(scope="module")
def run():
    scenario = load_scenario("acrobot_computed_torque", ["seed=3", "integration.max_step=0.002"])
    desired = [RigidTransform([0.1, 0.2, 0.3 + 0.1 * k]) for k in range(3)]
    actual = [
        RigidTransform(RollPitchYaw(0.0, turned, 0.0), X.translation() + np.array([off, 0.0, 0.0]))
        for X, off, turned in zip(desired, OFF, TURNED, strict=True)
    ]
    tensions = np.full((3, 8), 20.0)
    tensions[0] = [0.0, 500.0] * 4  # before the first control step, which does not count
    tensions[1, 3], tensions[2, 6] = 4.5, 61.5
    log = {
        "time": np.array([0.0, 0.5, 1.0]),
        "X_WP": np.array([pose_row(X) for X in actual]),
        "X_WP_desired": np.array([pose_row(X) for X in desired]),
        "tensions": tensions,
        "failures": np.array([[0.0], [2.0], [5.0]]),
    }
    run = TensionRun(scenario)
    run.log, run.outcome, run.message = log, Outcome.COMPLETED, "why"
    run.sim_time, run.wall_time = 1.0, 0.25
    return run


def test_every_number_is_that_of_the_log(run):
    summary = run.as_dict()
    position, rotation = summary.pop("position_error_m"), summary.pop("rotation_error_rad")
    assert position == pytest.approx({"max": 0.02, "mean": 0.01, "final": 0.01}, abs=BY_HAND)
    mean = (0.1 + 0.3) / 3.0
    assert rotation == pytest.approx({"max": 0.3, "mean": mean, "final": 0.3}, abs=BY_HAND)
    assert summary.pop("versions")["drake"] == version("drake")
    assert summary == {
        "scenario": "acrobot_computed_torque",
        "kind": "tension_control",
        "loop": None,
        "robot": "acrobot_large",
        "geometry": "pulleys ignored",
        "controller": "computed_torque",
        "method": "barycenter",
        "seed": 3,
        "outcome": "completed",
        "message": "why",
        "sim_time_s": 1.0,
        "wall_time_s": 0.25,
        "realtime_factor": 4.0,
        "tension_n": {"min": 4.5, "max": 61.5},
        "tension_limits_n": [1.0, 60.0],
        "remarks": [
            "distribution.limits = 1 to 60 N replace tension_bounds of acrobot_large, 0 to 60 N; "
            "null takes those"
        ],
        "infeasible_steps": 5,
        "simulated": {"damping_n_s_per_m": 0.0, "damping_n_m_s_per_rad": 0.0, "overrides": []},
        "engine": "plant",
        "integration_step_s": 0.002,
        "world": None,
    }


def test_what_a_run_cannot_have_is_none(run):
    first = TensionRun(run.scenario)
    first.log = {key: values[:1] for key, values in run.log.items()}
    first.outcome = Outcome.DIVERGED
    found = first.as_dict()
    assert found["realtime_factor"] is None
    assert found["tension_n"] == {"min": None, "max": None}
    assert found["outcome"] == "diverged"


def test_the_integrator_is_that_of_the_scenario(run):
    engine = run.engine(Follow(prepare=lambda *_: None), False)
    assert isinstance(engine, DiagramEngine)
    simulator = engine._simulator(engine.context)
    assert simulator.get_integrator().get_fixed_step_mode()
    assert simulator.get_integrator().get_maximum_step_size() == 0.002
    X_WP = run.built.in_plant.pose(
        run.built.in_plant.plant.GetMyContextFromRoot(simulator.get_context())
    )
    np.testing.assert_allclose(X_WP.translation(), [0.0, 0.0, 0.2], atol=BY_HAND)
