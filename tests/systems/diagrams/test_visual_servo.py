"""A visual servo as a diagram: names, logs, seeds, ends, steps; its estimators and the fused pose.

Goals of every scheme are in tests of `controllers`.
"""

import numpy as np
import pytest

from cdpr_drake.analyses.runs.engine import fixed_step_simulator
from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.geometry.poses import pose_error, pose_from_row, pose_rows_distance
from cdpr_drake.systems.diagrams.calibration_findings import calibration_facts, found_calibrations
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.robots.cable_robot import automatic_step
from tests.systems.diagrams.diagram_cases import ENGINE, KNOWN_TAG, LOOP, PROJECTED, servo_run

REACHED = 0.5e-3
"""True distance from the desired pose at the end of a run [m]: stop rules ask for 0.3 mm measured,
and the pixel noise of 0.1 px adds to it. Eight seeds end within 0.12 mm."""

REACHED_ANGLE = np.radians(0.5)
"""True angle at the end, that of ACROBOT's stop rule."""

ESTIMATE = 2e-3, np.radians(0.1)
"""How far control integration strays without model errors [m, rad]: a platform whose cables wind at
constant speed for 40 ms leaves the constant twist that is integrated; measured 0.7 mm, 0.03 deg."""

ROUND_OFF = 1e-12
"""Of lengths of order one [m]."""


def built(name, *changes):
    return build_visual_servo(load_scenario(name, [PROJECTED, *changes]))


def systems(servo):
    return {system.get_name() for system in servo.diagram.GetSystems()}


def arrives(result):
    assert result.outcome == Outcome.CONVERGED
    distance, angle = result.end_error()
    assert distance < REACHED
    assert angle < REACHED_ANGLE


def test_subsystems_and_ports_are_public():
    servo = built("acrobot_pbvs")
    assert {"robot", "camera", "servo", "estimator", "monitor", "log_row"} <= systems(servo)
    assert "detector" not in systems(servo)
    diagram = servo.diagram
    assert diagram.get_name() == "acrobot_pbvs"
    assert diagram.num_input_ports() == 0
    ports = [diagram.get_output_port(i) for i in range(diagram.num_output_ports())]
    assert {port.get_name(): port.size() for port in ports} == {
        "platform_state": 13, "X_WP": 0, "tensions": 8, "lengths": 8, "slack": 8,
        "surplus_lengths": 8, "unstrained_lengths": 8, "corners": 8, "X_CO": 0, "found": 1,
        "cable_velocities": 8, "platform_velocity": 6, "error": 6, "gain": 1, "outcome": 1,
        "X_WP_estimated": 0,
    }  # fmt: skip
    servo = build_visual_servo(load_scenario("acrobot_pbvs"))  # a rendered camera has a detector
    assert {"robot", "camera", "detector", "servo", "estimator", "monitor"} <= systems(servo)
    assert servo.cable_robot.scene_graph.RendererCount() == 1


def test_a_run_converges_and_its_log_tells_it():
    run = servo_run("acrobot_pbvs")
    arrives(run)
    servo, log = run.built, run.log
    rows = len(log["time"])
    assert {name: values.shape for name, values in log.items()} == {
        "time": (rows,), "X_WP": (rows, 7), "X_WP_estimated": (rows, 7),
        "X_CO_measured": (rows, 7), "found": (rows, 1), "corners_px": (rows, 8),
        "error": (rows, 6), "gain": (rows, 1), "platform_velocity": (rows, 6),
        "cable_velocities": (rows, 8), "tensions": (rows, 8), "lengths": (rows, 8),
        "unstrained_lengths": (rows, 8), "slack": (rows, 8), "surplus_lengths": (rows, 8),
    }  # fmt: skip
    np.testing.assert_allclose(log["time"], np.arange(rows) / servo.scenario.log_rate)
    rest = run.sim_time - log["time"][-1]
    assert rest < 1.0 / servo.scenario.log_rate + ROUND_OFF
    start = pose_from_row(log["X_WP"][0])
    assert max(pose_error(servo.scenario.initial_pose.transform(), start)) < ROUND_OFF
    end = pose_from_row(log["X_WP"][-1])
    assert pose_error(end, servo.desired_platform_pose())[0] < REACHED
    assert np.all(log["tensions"] >= 0.0)
    np.testing.assert_array_equal(log["slack"], log["tensions"] == 0.0)
    error = np.linalg.norm(log["error"], axis=1)
    assert error[-1] < 0.05 * np.max(error)
    # Control integration follows a robot without model errors.
    distance, angle = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    assert np.max(distance) < ESTIMATE[0]
    assert np.max(angle) < ESTIMATE[1]


def test_one_seed_makes_one_run():
    logs = [servo_run("acrobot_pbvs", f"seed={seed}", "duration=0.5").log for seed in (3, 3, 4)]
    for name, values in logs[0].items():
        np.testing.assert_array_equal(values, logs[1][name])
    for name in ("corners_px", "X_WP"):
        assert not np.array_equal(logs[0][name], logs[2][name])


@pytest.mark.parametrize(
    "change",
    [
        "perturbations.initial_pose={position: [0.13, -0.01, 0.32], angles_deg: [-8, -6, 4]}",
        "perturbations.exit_points=0.01",
        "perturbations.anchor_points=0.008",
        "perturbations.camera_pose={position: [0.02, -0.01, 0.01], angles_deg: [3, -4, 10]}",
        "camera.latency_frames=2",
    ],
)
def test_a_servo_converges_with_a_wrong_model_and_late_images(change):
    """The camera closes the loop; servoing thesis 3.3 takes 8 mm as an error of anchor points."""
    result = servo_run("acrobot_pbvs", change, *LOOP)
    if "latency" in change:
        assert result.outcome == Outcome.CONVERGED
    else:
        arrives(result)


def test_a_target_out_of_view_ends_the_run():
    result = servo_run("acrobot_pbvs", "target.pose.position=[-0.5, 0.5, 0.0]")
    assert result.outcome == Outcome.TARGET_LOST
    assert result.sim_time < result.built.scenario.stop.target_lost + 0.2
    assert not np.any(result.log["found"])
    assert not np.any(result.log["cable_velocities"])


def test_a_step_of_the_file_is_used_and_an_automatic_one_is_stable():
    """At the desired pose, too: a platform that climbs gets stiffer, and so needs shorter steps."""
    assert built("acrobot_pbvs", "integration.max_step=1e-4").max_step == 1e-4
    assert 1e-4 < built("acrobot_pbvs").max_step < 1e-2
    servo = built("acrobot_pbvs", "initial_pose={position: [0.1, -0.1, 0.15]}",
        "target.pose.position=[0.06, -0.08, 0]", "desired.position=[0, 0, 0.75]")  # fmt: skip
    X_WP = servo.X_WO @ (servo.X_PC @ servo.X_CdO).inverse()
    assert servo.max_step <= automatic_step(servo.robot, X_WP, "runge_kutta3")


STEP = 0.4
"""Simulated time of a short look [s]: ten control steps."""

CLOSE = 5e-3
"""What an estimate may be off after ten control steps [m]; single images of the tag err by 4 mm,
and by 25 mm on CAROCA."""


def look(*overrides, name="acrobot_pbvs", time=STEP):
    servo = built(name, *overrides)
    context = servo.make_context()
    fixed_step_simulator(servo.diagram, context, "runge_kutta3", servo.max_step).AdvanceTo(time)
    return servo, servo.log.read(context)


@pytest.mark.parametrize("name", ["acrobot_pbvs", "caroca_pbvs", "planar_pbvs"])
def test_all_estimators_run_side_by_side_and_are_close_at_first(name):
    # Those need tags of their own, and have tests of their own.
    other = ("known_tag", "eye_to_hand", "sensor_fusion")
    kinds = [kind for kind in ESTIMATORS if kind not in other]
    _, log = look("estimator.kind=fusion", f"estimator.compare={kinds}", name=name)
    for kind in kinds:
        distance, _ = pose_rows_distance(log["X_WP"], log[f"X_WP_{kind}"])
        if kind == "shifted":  # nothing shifts it here
            np.testing.assert_allclose(log["X_WP_shifted"], log["X_WP_measured"], atol=ROUND_OFF)
            continue
        # The tracker errs by a share of the distance from where it was registered.
        limit = CLOSE if kind != "measured" else 0.02
        assert np.max(distance[1:]) < limit * (6.0 if name == "caroca_pbvs" else 1.0), kind


def test_shifted_is_what_is_measured_off_by_the_error_of_the_start():
    shift = "perturbations.initial_pose_shift={distance: 0.03, angle_deg: 4}"
    _, log = look(shift, "estimator.compare=[measured, shifted]")
    distance, angle = pose_rows_distance(log["X_WP_measured"], log["X_WP_shifted"])
    np.testing.assert_allclose(distance, 0.03, atol=ROUND_OFF)
    np.testing.assert_allclose(angle, np.radians(4.0), atol=1e-7)  # an angle by its cosine
    shifts = log["X_WP_shifted"][:, 4:] - log["X_WP_measured"][:, 4:]
    np.testing.assert_allclose(shifts, np.tile(shifts[0], (len(shifts), 1)), atol=ROUND_OFF)


@pytest.mark.parametrize("kind", ["control_integration", "cable_lengths", "fusion", "measured"])
def test_the_servo_uses_the_named_estimator_which_follows_beside_a_moving_target(kind):
    moving = ("target.motion={velocity: [0.01, 0, 0]}", "sensors.tracker=c_track")
    servo, log = look(*moving, f"estimator.kind={kind}", f"estimator.compare=[{kind}]", time=0.8)
    np.testing.assert_array_equal(log["X_WP_estimated"], log[f"X_WP_{kind}"])
    used, beside = (
        servo.diagram.GetSubsystemByName(name) for name in ("estimator", f"estimator_{kind}")
    )
    assert type(used) is type(beside)
    distance, _ = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    assert np.max(distance[1:]) < CLOSE


def test_what_runs_beside_the_estimator_changes_nothing_but_brings_its_sensors():
    names = {"tension_sensors", "encoders", "tracker"}
    types = ("sensors.tension=vlu850", "sensors.encoder=servo_encoder")
    _, alone = look()
    _, beside = look("estimator.compare=[fusion, cable_lengths, first_image]")
    for name in ("X_WP", "cable_velocities"):
        np.testing.assert_array_equal(alone[name], beside[name])
    assert not names & systems(built("acrobot_pbvs", *types))
    compared = "estimator.compare=[cable_lengths, fusion, measured, cable_lengths_elastic]"
    servo, log = look(*types, compared)
    assert names <= systems(servo)
    distance, _ = pose_rows_distance(log["X_WP"], log["X_WP_cable_lengths_elastic"])
    assert 0.0 < np.max(distance[1:]) < CLOSE


@pytest.mark.parametrize(
    ("camera", "region"), [("projected", "whole"), ("rendered", "whole"), ("rendered", "target")]
)
def test_a_known_tag_begins_estimates_anew(camera, region):
    """The start is believed 5 cm away; the tag in view tells it after 0.1 s."""
    _, log = look(
        KNOWN_TAG, f"camera.kind={camera}", f"camera.region={region}",
        "estimator.compare=[known_tag, cable_lengths]",
        "perturbations.initial_pose_shift.distance=0.05", time=0.3,
    )  # fmt: skip
    for name in ("estimated", "known_tag", "cable_lengths"):
        distance, _ = pose_rows_distance(log["X_WP"], log[f"X_WP_{name}"])
        assert distance[0] == pytest.approx(0.05, rel=1e-3)
        assert distance[-1] < 0.01, name


FUSION = "estimator.sensor_fusion"


def fused_run(*changes):
    shared = [ENGINE, "log_rate=25", "duration=1.0"]
    return ServoRun(load_scenario("acrobot_fusion", [*shared, *changes])).simulate().log


IMU = ["sensors.imu={type: adis16448}", f"{FUSION}.imu=true"]


@pytest.mark.parametrize("imu", [[], IMU], ids=["as commanded", "by IMU"])
def test_a_fused_pose_says_what_it_used_and_leads_on_while_a_camera_is_covered(imu):
    """The camera on board is covered from the third image on; all other sources are there."""
    covered = fused_run(
        "estimator.compare=[control_integration]", f"{FUSION}.external_depth=kinect",
        "camera.fault={kind: dead, start: 0.08, duration: 9}", f"{FUSION}.on_board_depth=ideal",
        *imu,
    )  # fmt: skip
    sources = covered["fusion_sources"]
    assert sources.shape[1] == 5
    on_board, external, lengths, _, depth = sources[2:].T
    assert np.all(on_board[2:] == 0.0)
    assert np.mean(external == 1.0) > 0.9
    assert np.all(lengths > 0.5)
    assert np.mean(depth > 0.7) > 0.9
    assert np.nanmean(covered["fusion_nis"][2:, 1]) < 3.0
    deviations = np.sqrt(np.diagonal(covered["fusion_covariance"][2:].reshape(-1, 6, 6), 0, 1, 2))
    assert np.all((deviations > 1e-5) & (deviations < 0.05))
    # The servo goes on, better than by commands.
    assert not np.any(covered["found"][4:])
    speed = np.linalg.norm(covered["platform_velocity"][5:, 3:], axis=1)
    assert np.min(speed) > 0.01
    fused, _ = pose_rows_distance(covered["X_WP"], covered["X_WP_estimated"])
    commanded, _ = pose_rows_distance(covered["X_WP"], covered["X_WP_control_integration"])
    assert np.mean(fused[5:]) < np.mean(commanded[5:])
    # Without doubt a run says how a calibration fits.
    found = found_calibrations(covered["fusion_calibration"][-1])
    assert {each["probability_worse"] for each in found.values()} == {None}
    assert all(each["judged"] in ("as told", "nothing learnt") for each in found.values())
    assert 1e-4 < found["external"]["position_deviation_m"] < 0.01
    assert len(calibration_facts(found)) == 2


DOUBTED = [
    "estimator.compare=[]", "camera.fault=null",
    f"{FUSION}.on_board_doubt={{}}", f"{FUSION}.external_doubt={{position: 0.05, rotation_deg: 3}}",
]  # fmt: skip


def doubted_run(*changes):
    """What is found of both cameras, and the estimate's largest error but for the start [m]."""
    log = fused_run(*DOUBTED, *changes)
    distance, _ = pose_rows_distance(log["X_WP"], log["X_WP_estimated"])
    return found_calibrations(log["fusion_calibration"][-1]), np.max(distance[5:])


def test_a_camera_in_the_world_that_is_wrong_is_found_and_does_no_harm():
    """6 cm and 2 deg wrong from the start, which two right sources contradict: the start, wrong by
    1 cm, and the target's first image say nothing of it, so the pose stays as good as the start."""
    shift = "perturbations.external_camera_shift={distance: 0.06, angle_deg: 2}"
    found, largest = doubted_run(shift)
    assert found["external"]["judged"] == "worse than told"
    assert found["external"]["probability_worse"] > 0.95
    assert found["on_board"]["judged"] != "worse than told"
    assert abs(found["external"]["position_m"] - 0.06) < 0.03
    assert largest < 0.015
    # Nobody doubts it: the same camera takes the pose with it, and the summary says that it or
    # something else does not fit.
    trusted, with_it = doubted_run(shift, f"{FUSION}.external_doubt=null", f"{FUSION}.gate=0")
    assert with_it > 2.0 * largest
    assert trusted["external"]["judged"] == "does not fit"


def test_a_camera_that_is_knocked_under_way_is_calibrated_anew():
    """Its doubt is settled then: what was told of it is forgotten."""
    knock = "{kind: off, start: 0.2, duration: 9, offset: [0.02, 0.02, 0.0], angles_deg: [0, 1, 0]}"
    found, largest = doubted_run(f"estimator.platform_tag.fault={knock}", f"{FUSION}.patience=0.3")
    assert found["external"]["probability_worse"] == 1.0
    assert 0.01 < found["external"]["position_m"] < 0.06
    assert largest < 0.015
