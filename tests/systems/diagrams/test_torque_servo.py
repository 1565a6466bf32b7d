"""A visual servo by torque: slack goes, limits hold, engines agree, wrong input is refused."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.simulation.run_figures import run_figures
from cdpr_drake.analyses.simulation.run_summary import summarize
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.cli.app import main
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_error, pose_from_row
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.torque_control import loop_warnings
from tests.messages import printed

PROJECTED, COMPILED = "camera.kind=projected", "integration.engine=compiled"
NO_SLACK = "perturbations.slack=null"
NEAR = "initial_pose={position: [-0.14, -0.19, 0.364], angles_deg: [9.3, -18.6, 29.0]}"
"""A little beside the goal of case IX."""

TAG = (
    "platform_tag: {tag_id: 5, size: 0.12, "
    "pose: {position: [0, -0.1, 0.06], angles_deg: [55, 0, 0]}}"
)

SAME_ENGINES = 1e-6
"""Between the engines after some tenths of a second [m, rad]: the integrator's, as both have the
same kernels and steps."""


def load(*changes, scenario="acrobot_torque_servo"):
    return load_scenario(scenario, [PROJECTED, *changes])


@pytest.fixture(scope="module")
def slack_start():
    return run_scenario(load(COMPILED, "duration=1.2"))


@pytest.fixture(scope="module")
def short():
    return run_scenario(load(COMPILED, "duration=0.4"))


def test_slack_is_wound_up_at_the_winding_speed_and_limits_hold_from_then_on(slack_start):
    found = summarize(slack_start)["torque_control"]
    assert found["steps"] == pytest.approx(1200, abs=1)
    assert 0.6 < found["taut_after_s"] < 0.8 / 0.95  # 4 cm at 0.05 m/s, and what the platform does
    assert found["within_limits"]
    assert found["largest_excess_n"] == 0.0
    assert found["lowest_tension_n"] > found["tension_limits_n"][0] == 1.0
    assert found["highest_tension_n"] < found["tension_limits_n"][1] == 60.0
    assert found["rates_within_limit"]
    assert found["largest_rate_n_per_s"] == pytest.approx(200.0)  # where C1 and C2 begin to pull
    assert found["relaxed_share"] == 0.0
    log = slack_start.log
    later = log["time"] > found["taut_after_s"] + 0.1
    assert np.all(log["slack"][later] == 0.0)
    # Sensors are off by 0.24 N; what else there is between wanted and true tensions is the loop's.
    assert np.max(np.abs(log["tensions"] - log["wanted_tensions"])[later]) < 0.24 + 0.5


def test_the_last_cable_to_come_taut_stays_above_the_limit_where_its_winch_once_stopped():
    """A run of case IX in which C2 fell to 0.94 N for 9 ms just after it had come taut."""
    run = run_scenario(load(
        COMPILED, "duration=0.8", "seed=4",
        "perturbations.initial_pose_shift={distance: 0.02, angle_deg: 1.5}",
        "perturbations.exit_points=0.002", "perturbations.anchor_points=0.001",
        "torque_control={method: barycenter, limits: [1, 60], friction_ratio: 1.1}",
    ))  # fmt: skip
    found = summarize(run)["torque_control"]
    assert found["taut_after_s"] < 0.76
    assert found["lowest_tension_n"] >= 1.0
    assert found["within_limits"]


def test_excess_is_counted_where_limits_are_too_narrow(slack_start):
    report = slack_start.torque
    upper = float(report.extremes.highest.max()) - 0.5
    narrow = replace(report, limits=(1.0, upper))
    assert narrow.excess() == pytest.approx(0.5)


def test_motor_torques_are_tensions_by_radius_over_gear(slack_start):
    """In the mean over time, as friction and what accelerates the motors are left out."""
    log, law = slack_start.log, slack_start.servo.robot.winch_law()
    later = log["time"] > 0.9
    rho = law.drum.radius / law.drum.gear_ratio
    pull = (log["friction_torques"] - log["applied_torques"])[later].mean(axis=0) / rho
    np.testing.assert_allclose(pull, log["tensions"][later].mean(axis=0), atol=0.3)


def test_it_draws_wanted_tensions(slack_start, tmp_path):
    drawn = run_figures(slack_start, ("png",))
    assert any("tension_loop" in name for name in drawn)


def test_both_engines_do_the_same(short):
    plant = run_scenario(load("integration.engine=plant", "duration=0.4"))
    ends = [pose_from_row(run.log["X_WP"][-1]) for run in (short, plant)]
    distance, angle = pose_error(*ends)
    assert distance < SAME_ENGINES
    assert angle < SAME_ENGINES
    assert plant.torque.steps == short.torque.steps


def test_it_ends_where_velocity_control_ends_with_friction_off_by_30_per_cent():
    run = run_scenario(load(
        COMPILED, NO_SLACK, NEAR, "duration=4",
        "torque_control={method: barycenter, limits: [1, 60], friction_ratio: 0.7}",
    ))  # fmt: skip
    found = summarize(run)
    assert found["final_position_error_m"] <= 0.5e-3
    assert np.degrees(found["final_rotation_error_rad"]) <= 0.5
    assert found["torque_control"]["within_limits"]
    assert np.all(run.log["slack"] == 0.0)


def test_a_second_camera_tells_the_pose_from_outside():
    """Fig. 5.8: what was believed wrongly at the start is known from the first image on."""
    shift = "perturbations.initial_pose_shift={distance: 0.02, angle_deg: 1.5}"
    run = run_scenario(
        load(COMPILED, NO_SLACK, shift, f"estimator={{kind: eye_to_hand, {TAG}}}", "duration=0.4")
    )
    log = run.log
    distances = [
        pose_error(pose_from_row(a), pose_from_row(b))[0]
        for a, b in zip(log["X_WP"], log["X_WP_estimated"], strict=True)
    ]
    # A tenth of a pixel of noise, from a metre away, is some millimetres.
    assert max(distances[1:]) < 0.012
    assert np.median(distances[1:]) < 0.004


@pytest.mark.parametrize("mode", ["torque", "position", "velocity"])
def test_a_planned_pose_is_where_the_target_is_seen_as_desired(mode):
    """Figs 5.9, 5.10, (5.9), with a pose and a camera that are believed rightly."""
    changes = [COMPILED, NO_SLACK, "pose_plan={}", "duration=0.5", "camera.pixel_noise=0"]
    kind = "ideal" if mode == "velocity" else "motor"
    if mode != "torque":
        changes += ["torque_control=null"]
    run = run_scenario(load(*changes, f"winches={{kind: {kind}, mode: {mode}}}"))
    log, servo = run.log, run.servo
    goal = servo.desired_platform_pose()
    for row in log["X_WP_goal"][3:]:
        distance, angle = pose_error(pose_from_row(row), goal)
        assert distance < 0.004  # the estimate's
        assert angle < 0.02
    # It has left for there, faster and faster.
    left = [pose_error(pose_from_row(row), goal)[0] for row in log["X_WP"]]
    assert left[-1] < left[0] - 0.001
    assert np.all(np.diff(log["gain"][:, 0][3:]) >= 0.0)


def test_a_loop_too_fast_for_stiff_cables_is_warned_of():
    robot = load_robot("acrobot_large")
    assert loop_warnings(load(), robot) == []
    (words,) = loop_warnings(load("cables={stiffness_ratio: 1}"), robot)
    assert (
        "torque_control.proportional: found 4; the tension loop is not stable at 1000 Hz" in words
    )
    good = float(words.rsplit("; at ", 1)[1].removesuffix(" it is"))
    again = f"torque_control.proportional={good}"
    assert loop_warnings(load("cables={stiffness_ratio: 1}", again), robot) == []
    assert loop_warnings(load(scenario="acrobot_pbvs"), robot) == []


def refused(*changes, scenario="acrobot_torque_servo"):
    with pytest.raises(ScenarioError) as caught:
        load(*changes, scenario=scenario)
    return str(caught.value)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["torque_control.rate=1500", "integration.max_step=0.001"],
         r"torque_control.rate: found 1500; accepted: a whole number of steps"),
        (["torque_control.rate=10"], "torque_control.rate: found 10; accepted: at least"),
        (["torque_control.proportional=-1"],
         "torque_control.proportional: found -1; accepted: a number >= 0"),
        (["torque_control.derivative=0"],
         "torque_control.derivative: found 0; accepted: a number > 0 [N s/m]"),
        (["torque_control.margin=40"], "torque_control.margin: found 40 with limits 1 to 60 N"),
        (["torque_control.slack_below=2"],
         "torque_control.slack_below: found 2; accepted: at most 0.5 [N]"),
        (["torque_control.method=kernel"], "torque_control.method: kernel: found redundancy"),
        (["torque_control.method=reference_program"], "reference_program: found no reference"),
        (["winches.mode=velocity"],
         "torque_control: found a section with winches.mode velocity; accepted: null"),
        (["winches.kind=ideal"], "winches.mode: found torque with ideal winches"),
        (["tension_management={}"], "tension_management: found a section with winches.mode torque"),
        (["estimator.kind=eye_to_hand"], "estimator.platform_tag: found none"),
        ([f"estimator={{{TAG.replace('{tag_id', '{mount: onboard, tag_id')}}}"],
         "estimator.platform_tag.mount: 'onboard' is not in the world"),
        (["pose_plan={}", "trajectory={}"], "trajectory: found a section with pose_plan"),
        (["pose_plan={}", "controller.free_rotation=true"],
         "controller.free_rotation: found true with pose_plan"),
        (["pose_plan={speed: 0}"], "pose_plan.speed: found 0; accepted: a number > 0"),
    ],
)  # fmt: skip
def test_what_is_asked_wrongly_is_named(changes, words):
    assert words in refused(*changes)


def test_torque_without_motor_inertia_is_refused(tmp_path, capsys):
    lines = robot_file("acrobot_large").read_text().splitlines()
    robot = tmp_path / "robot.yaml"
    robot.write_text("\n".join(line for line in lines if not line.startswith("  inertia:")))
    with pytest.raises(SystemExit) as ended:
        main(["simulate", "acrobot_torque_servo", "--set", f"robot={robot}"])
    assert ended.value.code == 2
    said = printed(capsys).err
    assert "winches.kind: found motor" in said
    assert "winch.inertia" in said
