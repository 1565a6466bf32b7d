"""A servo whose images come late: it settles as long as gain times delay is below pi / 2."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import choose_compiled_loop

SETTLED, SWINGS = 2e-3, 1e-2
"""Speeds that are asked for in the last third of a run, far below and above each other [m/s]."""

GAIN = 2.0


def asked(frames, estimator):
    """Largest speed that the servo asks for in the last third of a run [m/s], and its delay [s]."""
    scenario = load_scenario("acrobot_pbvs", [
        "camera.kind=projected", "integration.engine=compiled", "stop.hold=100",
        f"camera.latency_frames={frames}", f"estimator.kind={estimator}", "duration=15",
        "log_rate=25",
    ])  # fmt: skip
    assert scenario.controller.lambda_0 == GAIN
    log = run_scenario(choose_compiled_loop(scenario)).log
    late = log["time"] > 10.0
    speed = np.linalg.norm(log["platform_velocity"][late, 3:], axis=1)
    return float(np.max(speed)), frames / scenario.camera.rate


@pytest.mark.parametrize("estimator", ["control_integration", "first_image"])
def test_images_may_be_late_by_less_than_a_quarter_of_a_swing(estimator):
    """dx/dt = -gain x(t - delay) has roots to the left for gain delay < pi / 2 only; beyond, the
    gain that falls with the error bounds the swing."""
    speed, delay = asked(10, estimator)
    assert GAIN * delay < np.pi / 2.0
    assert speed < SETTLED
    speed, delay = asked(26, estimator)
    assert GAIN * delay > np.pi / 2.0
    assert SWINGS < speed < 1.0
