"""Every estimator of the registry in a whole diagram, wired by the names of its ports."""

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.visual_servo_run import make_simulator
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_rows_distance
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS

STEP = 0.4
"""Simulated time of a short look [s]: ten control steps."""

CLOSE = 5e-3
"""What an estimate may be off after ten control steps [m]; single images of the tag err by 4 mm,
and by 25 mm on CAROCA."""

ROUNDING = 1e-12
"""Of poses that are the same but for a product with a fixed one."""

KNOWN_TAG = (
    "estimator.known_tag={tag_id: 7, size: 0.06, pose: {position: [0.12, -0.02, 0]}, period: 0.1}"
)


def run(*overrides, name="acrobot_pbvs", time=STEP):
    servo = build_visual_servo(load_scenario(name, ["camera.kind=projected", *overrides]))
    context = servo.make_context()
    make_simulator(servo, context).AdvanceTo(time)
    return servo, servo.log.read(context)


@pytest.mark.parametrize("name", ["acrobot_pbvs", "caroca_pbvs", "planar_pbvs"])
def test_all_run_side_by_side_and_are_close_at_first(name):
    # These need tags of their own, and have tests of their own.
    other = ("known_tag", "eye_to_hand", "sensor_fusion")
    kinds = [kind for kind in ESTIMATORS if kind not in other]
    _, log = run("estimator.kind=fusion", f"estimator.compare={kinds}", name=name)
    for kind in kinds:
        distance, _ = pose_rows_distance(log["X_WP"], log[f"X_WP_{kind}"])
        if kind == "shifted":  # nothing shifts it here
            np.testing.assert_allclose(log["X_WP_shifted"], log["X_WP_measured"], atol=ROUNDING)
            continue
        # The tracker errs by a share of the distance from where it was registered.
        limit = CLOSE if kind != "measured" else 0.02
        assert np.max(distance[1:]) < limit * (6.0 if name == "caroca_pbvs" else 1.0), kind


def test_shifted_is_what_is_measured_off_by_the_error_of_the_start():
    _, log = run(
        "perturbations.initial_pose_shift={distance: 0.03, angle_deg: 4}",
        "estimator.compare=[measured, shifted]",
    )
    distance, angle = pose_rows_distance(log["X_WP_measured"], log["X_WP_shifted"])
    np.testing.assert_allclose(distance, 0.03, atol=ROUNDING)
    np.testing.assert_allclose(angle, np.radians(4.0), atol=1e-7)  # an angle by its cosine


@pytest.mark.parametrize("kind", ["control_integration", "cable_lengths", "fusion", "measured"])
def test_the_servo_uses_the_one_that_is_named(kind):
    servo, log = run(f"estimator.kind={kind}", f"estimator.compare=[{kind}]")
    np.testing.assert_array_equal(log["X_WP_estimated"], log[f"X_WP_{kind}"])
    assert type(servo.diagram.GetSubsystemByName("estimator")) is type(
        servo.diagram.GetSubsystemByName(f"estimator_{kind}")
    )


def test_comparing_changes_nothing():
    """What runs beside the estimator has no effect on the run."""
    _, alone = run()
    _, beside = run("estimator.compare=[fusion, cable_lengths, first_image]")
    np.testing.assert_array_equal(alone["X_WP"], beside["X_WP"])
    np.testing.assert_array_equal(alone["cable_velocities"], beside["cable_velocities"])


def test_only_sensors_that_are_read_are_there():
    servo, _ = run("sensors.tension=vlu850", "sensors.encoder=servo_encoder", time=0.05)
    names = [system.get_name() for system in servo.diagram.GetSystems()]
    assert not {"tension_sensors", "encoders", "tracker"} & set(names)
    servo, _ = run(
        "sensors.tension=vlu850",
        "sensors.encoder=servo_encoder",
        "estimator.compare=[cable_lengths, fusion, measured]",
        time=0.05,
    )
    names = [system.get_name() for system in servo.diagram.GetSystems()]
    assert {"tension_sensors", "encoders", "tracker"} <= set(names)


def test_sensors_of_the_catalogue_give_estimates_too():
    _, log = run(
        "sensors.tension=vlu850",
        "sensors.encoder=servo_encoder",
        "estimator.compare=[cable_lengths_elastic]",
    )
    distance, _ = pose_rows_distance(log["X_WP"], log["X_WP_cable_lengths_elastic"])
    assert 0.0 < np.max(distance[1:]) < CLOSE


@pytest.mark.parametrize("camera", ["projected", "rendered", "rendered region"])
def test_a_known_tag_begins_estimates_anew(camera):
    """The start is believed 5 cm away; the tag in view tells it after 0.1 s."""
    _, log = run(
        KNOWN_TAG,
        f"camera.kind={camera.split()[0]}",
        f"camera.region={'target' if camera.endswith('region') else 'whole'}",
        "estimator.compare=[known_tag, cable_lengths]",
        "perturbations.initial_pose_shift.distance=0.05",
        time=0.3,
    )
    for name in ("estimated", "known_tag", "cable_lengths"):
        distance, _ = pose_rows_distance(log["X_WP"], log[f"X_WP_{name}"])
        assert distance[0] == pytest.approx(0.05, rel=1e-3)
        assert distance[-1] < 0.01, name


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("estimator.kind=control_integraton", "accepted: one of control_integration"),
        ("estimator.kind=known_tag", "estimator.known_tag: found none"),
        (KNOWN_TAG.replace("tag_id: 7", "tag_id: 0"), "that of the target"),
        ("estimator.compare=[fusion, fusion]", "found fusion twice"),
        ("estimator.compare=[fussion]", "found fussion; did you mean fusion"),
        ("estimator.compare=fusion", "found fusion; accepted: a list of control_integration"),
        ("estimator.fusion.legnth=1", "did you mean length"),
        ("sensors.tension=vlu580", "accepted: one of ideal, tractel, vlu850"),
        (
            "target.motion={velocity: [0.01, 0, 0]}; estimator.kind=first_image",
            "estimator.kind: found first_image, but the target moves, so what differs",
        ),
        (
            "target.motion={velocity: [0.01, 0, 0]}; estimator.compare=[consecutive_images]",
            r"estimator.compare\[0\]: found consecutive_images, but the target moves",
        ),
        (
            "target.kind=circles; controller.scheme=circles; estimator.kind=first_image",
            "circles do not show their rotation",
        ),
    ],
)
def test_bad_input_is_refused(override, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario("acrobot_pbvs", override.split("; "))


@pytest.mark.parametrize("kind", ["control_integration", "cable_lengths", "fusion", "measured"])
def test_the_others_follow_a_moving_target(kind):
    _, log = run(
        "target.motion={velocity: [0.01, 0, 0]}",
        f"estimator.kind={kind}",
        "sensors.tracker=c_track",
        time=1.0,
    )
    distance, _ = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    assert np.max(distance[1:]) < CLOSE
