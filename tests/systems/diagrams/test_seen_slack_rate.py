"""Tension management by slack that a camera sees: wired, faster than by tension, refused."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import robot_file
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


def test_with_a_rendered_camera_cables_are_found_in_images():
    """As fast as by projected points, to what an image a tenth of a second later makes of it."""
    section = "{kind: image, gain: 0.04, allowance: 0.002, sight_rate: 10}"
    scenario = slack_run(section)
    changed = replace(scenario, camera=replace(scenario.camera, kind="rendered"))
    log = run_scenario(changed).log
    slack = np.any(log["surplus_lengths"][:, :2] > TAUT, axis=1)
    assert log["time"][np.flatnonzero(slack)[-1]] < 0.6
    # At the start 38 mm of 40 are beyond the allowance, in 0.2 s; two deviations are left.
    assert np.min(log["tension_corrections"]) == pytest.approx(-(SLACK - 0.002) / 0.2, rel=0.1)


def test_a_lens_is_refused_where_images_are_drawn(tmp_path):
    camera = tmp_path / "lens.yaml"
    camera.write_text(
        "name: lens\ntitle: t\nsource: s\nwidth: 640\nheight: 480\n"
        "view_angle_horizontal_deg: 60.0\nview_angle_vertical_deg: 49.5\nrate_hz: 30.0\n"
        "distortion: {kind: brown_conrady, k1: -0.1}\n"
    )
    robot = tmp_path / "robot.yaml"
    text = robot_file("acrobot_large").read_text()
    at = text.index("name: overview")
    robot.write_text(text[:at] + text[at:].replace("model: astra", f"model: {camera}", 1))
    changes = [f"robot={robot}", "camera.kind=rendered", "tension_management={kind: image}"]
    with pytest.raises(ScenarioError, match="sight_mount: found overview, whose lens distorts"):
        load_scenario("acrobot_slack_start_tca", changes)
