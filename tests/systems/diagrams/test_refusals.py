"""Sections of scenarios whose diagram cannot be built are refused in one line that names them."""

from functools import partial

import pytest
import yaml

from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError, PlanningError, ScenarioError
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.sections.predictive.section import PredictiveDistributor
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop, can_be_compiled
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.messages import printed
from tests.systems.diagrams.diagram_cases import (
    PROJECTED,
    doubled,
    dynamic_control,
    written,
)
from tests.systems.robots.engines import parallelograms

SLACK_START, TORQUE, PBVS = "acrobot_slack_start_tca", "acrobot_torque_servo", "acrobot_pbvs"
MOVING = "target.motion={velocity: [0.01, 0, 0]}"


REFUSED = {
    "acrobot_fusion": [
        ("estimator.platform_tag=null; estimator.compare=[]", "estimator.platform_tag"),
        ("estimator.sensor_fusion.imu=true", "sensors.imu"),
        ("estimator.sensor_fusion.on_board=false", "told_object: found none"),
        ("estimator.sensor_fusion.external=false; estimator.sensor_fusion.external_depth=kinect",
         "external_depth: found"),
        ("camera.kind=rendered", "camera.fault"),
        ("estimator.platform_tag.rate=99", "platform_tag.rate: found 99; accepted: at most 30"),
        ("target.motion={velocity: [0.01, 0, 0]}", "does not rest"),
        ("robot=planar", "planar"),
        ("estimator.sensor_fusion.on_board=false; estimator.sensor_fusion.external=false; "
         "estimator.sensor_fusion.lengths=false; estimator.sensor_fusion.steer=false",
         "found no source"),
        ("estimator.sensor_fusion.external_doubt={position: 0.003}",
         "external_doubt.position: found 0.003; accepted: more than external_position"),
    ],
    "acrobot_pbvs": [
        ("estimator.kind=control_integraton", "accepted: one of control_integration"),
        ("estimator.kind=known_tag", "estimator.known_tag: found none"),
        ("estimator.known_tag={tag_id: 0, size: 0.06, pose: {position: [0.12, -0.02, 0]}, "
         "period: 0.1}",
         "that of the target"),
        ("estimator.compare=[fusion, fusion]", "found fusion twice"),
        ("estimator.compare=[fussion]", "found fussion; did you mean fusion"),
        ("estimator.compare=fusion", "found fusion; accepted: a list of control_integration"),
        ("estimator.fusion.legnth=1", "did you mean length"),
        ("sensors.tension=vlu580", "accepted: one of ideal, tractel, vlu850"),
        ("target.motion={velocity: [0.01, 0, 0]}; estimator.kind=first_image",
         "estimator.kind: found first_image, but the target moves, so what differs"),
        ("target.motion={velocity: [0.01, 0, 0]}; estimator.compare=[consecutive_images]",
         "estimator.compare[0]: found consecutive_images, but the target moves"),
        ("target.kind=circles; controller.scheme=circles; estimator.kind=first_image",
         "circles do not show their rotation"),
    ],
    "acrobot_slack_start_tca": [
        ("tension_management={kind: image, sight_mount: onboard}", "sight_mount: found onboard"),
        ("tension_management={kind: image, sight_rate: 100}",
         "sight_rate: found 100; accepted: at most 30"),
        ("tension_management={kind: image, closing_time: 0}", "closing_time"),
        ("tension_management={threshold: [60]}", "threshold: found 60; accepted: below 60 [N]"),
        ("tension_management={threshold: [1, 1, -0.5, 1, 1, 1, 1, 1]}",
         "threshold: found -0.5; accepted: at least 0"),
        ("tension_management={kind: by_length, highest: [-3], shortest: 1, longest: 2}",
         "highest: found -3; accepted"),
        ("tension_management={threshold: [1, 2]}",
         "threshold: found 2 values; accepted: one, or one for each of"),
        ("tension_management={threshold: [1, 1, 1, 1, 1, 1, 1, 1, 1]}",
         "threshold: found 9 values"),
        ("tension_management={kind: distribution, threshold: [1, 1, 1, 1, 1, 1, 1, 1]}",
         "accepted: one, by kind"),
        ("tension_management={kind: distribution, threshold: [-1]}",
         "threshold: found -1; accepted: at least 0"),
        ("tension_management={kind: distribution, method: reference_program}",
         "tension_management.method"),
        ("tension_management={kind: polygon, threshold: [1, 1, 1, 1, 1, 1, 1, 1]}",
         "accepted: one, by kind polygon"),
        ("tension_management={kind: polygon, margin: 30}",
         "margin: found 30; accepted: at most 29.5 [N], half"),
        ("tension_management={kind: polygon, margin: -1}",
         "margin: found -1; accepted: a number >= 0 [N]"),
        ("tension_management={kind: polygon, set_point: kernel}",
         "tension_management.set_point: kernel: found red"),
        ("tension_management={kind: polygon, threshold: [-1]}",
         "threshold: found -1; accepted: at least 0"),
        ("tension_management={gain: -0.04}", "gain: found -0.04"),
        ("tension_management={kind: adaptive, gain_per_length: -1}", "gain_per_length: found -1"),
        ("tension_management={kind: length, slowness: 0.5}", "slowness: found 0.5"),
        ("tension_management={kind: by_length}", "highest: found none; accepted: a number"),
        ("tension_management={kind: by_length, highest: [3], shortest: 2, longest: 1}",
         "longest: found 1"),
        ("tension_management={kind: by_length, highest: [0.5], shortest: 1, longest: 2}",
         "not below threshold"),
        ("tension_management={kind: by_length, threshold: [0], highest: [1], shortest: 1, "
         "longest: 2, shape: exponential}",
         "threshold: found 0; accepted: above 0"),
        ("tension_management={kind: magic}", "kind: found magic; accepted: one of constant"),
        ("tension_management={rate: 0}", "rate: found 0"),
        ("tension_management={rate: 300}; integration.max_step=0.001",
         "rate: found 300; accepted: a whole number of steps"),
    ],
    "acrobot_torque_servo": [
        ("torque_control.rate=1500; integration.max_step=0.001",
         "torque_control.rate: found 1500; accepted: a whole number of steps"),
        ("torque_control.rate=10", "torque_control.rate: found 10; accepted: at least"),
        ("torque_control.proportional=-1",
         "torque_control.proportional: found -1; accepted: a number >= 0"),
        ("torque_control.derivative=0",
         "torque_control.derivative: found 0; accepted: a number > 0 [N s/m]"),
        ("torque_control.margin=40", "torque_control.margin: found 40 with limits 1 to 60 N"),
        ("torque_control.slack_below=2",
         "torque_control.slack_below: found 2; accepted: at most 0.5 [N]"),
        ("torque_control.method=kernel", "torque_control.method: kernel: found redundancy"),
        ("torque_control.method=reference_program", "reference_program: found no reference"),
        ("winches.mode=velocity",
         "torque_control: found a section with winches.mode velocity; accepted: null"),
        ("winches.kind=ideal", "winches.mode: found torque with ideal winches"),
        ("tension_management={}", "tension_management: found a section with winches.mode torque"),
        ("estimator.kind=eye_to_hand", "estimator.platform_tag: found none"),
        ("estimator={platform_tag: {mount: onboard, tag_id: 5, size: 0.12, pose: "
         "{position: [0, -0.1, 0.06], angles_deg: [55, 0, 0]}}}",
         "estimator.platform_tag.mount: found 'onboard', which is not in the world"),
        ("pose_plan={}; trajectory={}", "trajectory: found a section with pose_plan"),
        ("pose_plan={}; controller.free_rotation=true",
         "controller.free_rotation: found true with pose_plan"),
        ("pose_plan={speed: 0}", "pose_plan.speed: found 0; accepted: a number > 0"),
    ],
}  # fmt: skip
"""By scenario: changes and what is said of them."""

FAULTS = {
    MOVING: 2, "robot=planar": 3, "tension_management={kind: by_length}": 3,
    "tension_management={kind: by_length, highest: [-3], shortest: 1, longest: 2}": 2,
}  # fmt: skip
"""Changes with several faults, one a line."""


@pytest.mark.parametrize(
    ("name", "changes", "words"), [(name, *row) for name, rows in REFUSED.items() for row in rows]
)
def test_a_scenario_without_sense_is_refused(name, changes, words):
    with pytest.raises(ScenarioError) as refused:
        load_scenario(name, changes.split("; "))
    lines = str(refused.value).splitlines()
    assert words in str(refused.value)
    assert len(lines) == FAULTS.get(changes, 1)
    assert all(len(line) <= 500 for line in lines)


def test_a_rate_of_whole_steps_is_taken():
    assert load_scenario(
        SLACK_START, [PROJECTED, "tension_management={rate: 500}", "integration.max_step=0.001"]
    )


def test_where_no_gain_is_stable_that_is_said():
    section = "tension_management={delay: 0.1}"
    scenario = load_scenario(SLACK_START, [PROJECTED, "cables.retardation_time=0", section])
    words = "tension_management.gain: found null; accepted for acrobot_large at 25 Hz with a delay"
    with pytest.raises(ScenarioError, match=words):
        build_visual_servo(scenario)


def lens(folder):
    """ACROBOT with a distorting lens at its camera in the world."""
    camera = folder / "lens.yaml"
    camera.write_text(
        "name: lens\ntitle: t\nsource: s\nwidth: 640\nheight: 480\n"
        "view_angle_horizontal_deg: 60.0\nview_angle_vertical_deg: 49.5\nrate_hz: 30.0\n"
        "distortion: {kind: brown_conrady, k1: -0.1}\n"
    )
    content = yaml.safe_load(robot_file("acrobot_large").read_text())
    (overview,) = (mount for mount in content["cameras"] if mount["name"] == "overview")
    overview["model"] = str(camera)
    return content


ROBOTS = {
    "lens": (lens, SLACK_START, ["camera.kind=rendered", "tension_management={kind: image}"],
        ["sight_mount: found overview, whose lens distorts"]),
    "three winches": (lambda _: parallelograms(), PBVS, [PROJECTED, "tension_management={}"],
        ["with 3 winches for 6 cables; accepted: at least 6",
         "tension_management: found a section, which takes up slack cable by cable"]),
    "tensions of one winch": (lambda _: doubled(), "acrobot_computed_torque", [],
        ["which cannot be given tensions one by one"]),
}  # fmt: skip


@pytest.mark.parametrize("case", ROBOTS)
def test_a_robot_that_does_not_fit_is_refused(case, tmp_path):
    content, name, changes, words = ROBOTS[case]
    robot = written(tmp_path, content(tmp_path))
    with pytest.raises(ScenarioError) as refused:
        load_scenario(name, [*changes, robot])
    for part in words:
        assert part in str(refused.value)


def test_torque_without_motor_inertia_is_refused(tmp_path, capsys):
    lines = robot_file("acrobot_large").read_text().splitlines()
    robot = tmp_path / "robot.yaml"
    robot.write_text("\n".join(line for line in lines if not line.startswith("  inertia:")))
    with pytest.raises(SystemExit) as ended:
        main(["simulate", TORQUE, "--set", f"robot={robot}"])
    assert ended.value.code == 2
    message = printed(capsys).err
    assert "winches.kind: robot acrobot_large" in message
    assert "winch.inertia" in message


def test_prediction_refuses_forces_alone():
    home = load_robot("acrobot_large").home.transform()
    motion = PoseTrajectory((home, home), (1.0,))
    ahead = partial(PredictiveDistributor, trajectory=motion, steps=5)
    with pytest.raises(PlanningError, match="balance: found force; accepted by predictive: wrench"):
        dynamic_control(balance="force", distributor=ahead)


def test_a_distributor_of_a_user_s_is_no_loop_of_kernels():
    class Own(TensionDistributor):
        pass

    control = dynamic_control(distributor=Own)
    assert not can_be_compiled(control)
    with pytest.raises(CdprError, match="acrobot_large: found a plant, a distributor"):
        TensionLoop(control, 100.0)
