"""The scenario that a new user runs: case study I, with cables that stay taut."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO

QUICK = ["camera.kind=projected", "integration.engine=compiled"]
SAME_ERROR = 1e-5
"""Tension correction winds up what carries nothing, and changes the final error by less [m]."""


def described(scenario):
    """All that a run depends on."""
    return {k: v for k, v in vars(scenario).items() if k not in ("name", "title", "source")}


@pytest.fixture(scope="module")
def taut():
    return run_scenario(load_scenario(DEFAULT_SCENARIO, QUICK))


@pytest.fixture(scope="module")
def plain():
    return run_scenario(load_scenario(DEFAULT_SCENARIO, [*QUICK, "tension_management=null"]))


def test_one_setting_makes_it_case_study_i(plain):
    changed = load_scenario(DEFAULT_SCENARIO, ["tension_management=null"])
    assert str(described(changed)) == str(described(load_scenario("acrobot_pbvs", [])))
    short = run_scenario(load_scenario("acrobot_pbvs", [*QUICK, "duration=0.2"])).log
    for name in ("X_WP", "tensions", "cable_velocities"):
        np.testing.assert_array_equal(short[name], plain.log[name][: len(short["time"])])


def test_its_cables_stay_taut_and_its_error_is_the_same(taut, plain):
    one, other = summarize(taut), summarize(plain)
    assert one["outcome"] == other["outcome"] == "converged"
    error = "final_position_error_m"
    assert one[error] == pytest.approx(other[error], abs=SAME_ERROR)
    assert one["sim_time_s"] == pytest.approx(other["sim_time_s"], abs=0.1)
    assert one["taut_cables"] == {"min": 8, "end": 8}
    assert other["taut_cables"]["end"] == 6
    assert other["slack_cable_seconds"] > 10.0


def test_its_gain_is_far_from_where_it_is_unstable():
    """The published gain is for cables that give: with these it lifts the platform."""

    def ends(gain):
        section = f"tension_management={{threshold: [0.5], gain: {gain}}}"
        return summarize(run_scenario(load_scenario(DEFAULT_SCENARIO, [*QUICK, section])))

    assert ends(0.003)["outcome"] == "converged"  # ten times its own
    assert ends(0.04)["outcome"] != "converged"
