"""Runs of every kind that are killed half way go on to the same bytes."""

import pytest

from cdpr_drake.analyses.runs.simulate import KINDS
from cdpr_drake.analyses.simulation import log_keeper
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import scenario_kind
from tests.analyses.simulation.resumed_runs import assert_it_goes_on_to_the_same_bytes


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("acrobot_computed_torque", ()),
        ("acrobot_friction", ("integration.engine=plant", "camera.kind=projected",
                              "winches.mode=position")),
        ("acrobot_sensors", ("camera.kind=projected", "estimator.kind=fusion")),
        ("acrobot_mobile_robot", ("integration.loop=compiled", "tension_management.rate=512")),
        ("acrobot_sensors", (
            "integration.loop=compiled", "camera.kind=projected", "camera.latency_frames=1",
            "estimator.kind=fusion", "sensors.log=[tension, encoder, tracker]",
        )),
    ],
)  # fmt: skip
def test_a_killed_run_goes_on(tmp_path, monkeypatch, scenario, changes):
    monkeypatch.setattr(log_keeper, "CHECKPOINT_WAIT", 0.0)
    kind = KINDS[scenario_kind(scenario)]
    wanted = load_scenario(scenario, [*changes, "duration=0.3"])
    assert_it_goes_on_to_the_same_bytes(kind, wanted, tmp_path, until=0.15)
