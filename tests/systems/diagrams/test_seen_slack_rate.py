"""Tension management by slack that a camera sees: wired, faster than by tension, refused."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import diagram_reason

SLACK = 0.04
TAUT = 1e-3
"""A cable that is longer than its way by less counts as taut [m]."""


def slack_run(section):
    changes = [
        "camera.kind=projected", "integration.engine=compiled", "duration=0.8", "log_rate=100",
        f"perturbations.slack=[{SLACK},{SLACK},0,0,0,0,0,0]", f"tension_management={section}",
    ]  # fmt: skip
    return load_scenario("acrobot_slack_start_tca", changes)


def test_slack_that_is_seen_is_wound_in_sooner():
    gone = {}
    for kind in ("{kind: constant, gain: 0.04}", "{kind: image, gain: 0.04, allowance: 0.002}"):
        log = run_scenario(slack_run(kind)).log
        slack = np.any(log["surplus_lengths"][:, :2] > TAUT, axis=1)
        gone[kind] = float(log["time"][np.flatnonzero(slack)[-1]])
        corrections = log["tension_corrections"]
        assert np.all(corrections <= 0.0)
    by_tension, by_image = gone.values()
    assert by_image < 0.75 * by_tension
    # At the start 38 mm of 40 are beyond the allowance, in 0.2 s.
    assert np.min(corrections) == pytest.approx(-(SLACK - 0.002) / 0.2, rel=0.1)


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("{kind: image, sight_mount: onboard}", "sight_mount: found onboard"),
        ("{kind: image, sight_rate: 100}", "sight_rate: found 100; accepted: at most 30"),
        ("{kind: image, closing_time: 0}", "closing_time"),
    ],
)
def test_cameras_that_are_not_there_are_refused(section, words):
    with pytest.raises(ScenarioError, match="accepted") as refused:
        slack_run(section)
    assert words in str(refused.value)


def test_a_loop_without_a_diagram_says_that_it_has_no_such_camera():
    assert "cables" in diagram_reason(slack_run("{kind: image}"))
