"""The summary of a run by tensions, against a log that is written by hand."""

from dataclasses import replace
from importlib.metadata import version

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.analyses.simulation.tension_control_run import (
    TensionRun,
    make_control,
    make_simulator,
    summarize_tension_run,
)
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome

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
    return TensionRun(
        scenario=scenario, control=make_control(scenario), log=log, outcome=Outcome.COMPLETED,
        message="why", sim_time=1.0, wall_time=0.25,
    )  # fmt: skip


def test_every_number_is_that_of_the_log(run):
    summary = summarize_tension_run(run)
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
    assert summarize_tension_run(replace(run, wall_time=0.0))["realtime_factor"] is None
    assert summarize_tension_run(replace(run, wall_time=1.0))["realtime_factor"] == 1.0
    first = {key: values[:1] for key, values in run.log.items()}
    found = summarize_tension_run(replace(run, log=first, outcome=Outcome.DIVERGED))
    assert found["tension_n"] == {"min": None, "max": None}
    assert found["outcome"] == "diverged"


def test_the_integrator_is_that_of_the_scenario(run):
    simulator = make_simulator(run.control, run.scenario)
    assert simulator.get_integrator().get_fixed_step_mode()
    assert simulator.get_integrator().get_maximum_step_size() == 0.002
    X_WP = run.control.in_plant.pose(
        run.control.in_plant.plant.GetMyContextFromRoot(simulator.get_context())
    )
    np.testing.assert_allclose(X_WP.translation(), [0.0, 0.0, 0.2], atol=BY_HAND)
