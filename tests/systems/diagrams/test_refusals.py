"""Sections of scenarios whose diagram cannot be built are refused in one line that names them."""

import pytest
import yaml

from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError, PlanningError, ScenarioError
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.systems.controllers.predictive_tensions import PredictiveTensions
from cdpr_drake.systems.controllers.tension_distributor import TensionDistributor
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.tension_loop import TensionLoop, can_be_compiled
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from tests.messages import printed
from tests.systems.diagrams.diagram_cases import (
    KNOWN_TAG,
    PLATFORM_TAG,
    PROJECTED,
    doubled,
    dynamic_control,
    written,
)
from tests.systems.robots.test_bundles import parallelograms

FUSION, FUSED = "estimator.sensor_fusion", "acrobot_fusion"
SLACK_START, TORQUE, PBVS = "acrobot_slack_start_tca", "acrobot_torque_servo", "acrobot_pbvs"
NO_SOURCES = [f"{FUSION}.{s}=false" for s in ("on_board", "external", "lengths", "steer")]
MOVING = "target.motion={velocity: [0.01, 0, 0]}"
MOUNTED = PLATFORM_TAG.replace("{tag_id", "{mount: onboard, tag_id")
EIGHT = "[1, 1, 1, 1, 1, 1, 1, 1]"


def managed(section):
    return SLACK_START, [PROJECTED, f"tension_management={section}"]


def servo(*changes):
    return TORQUE, [PROJECTED, *changes]


REFUSED = {
    "fusion: tag": (FUSED, ["estimator.platform_tag=null", "estimator.compare=[]"],
        "estimator.platform_tag"),
    "fusion: IMU": (FUSED, [f"{FUSION}.imu=true"], "sensors.imu"),
    "fusion: object": (FUSED, [f"{FUSION}.on_board=false"], "told_object: found none"),
    "fusion: depth": (FUSED, [f"{FUSION}.external=false", f"{FUSION}.external_depth=kinect"],
        "external_depth: found"),
    "fusion: rendered": (FUSED, ["camera.kind=rendered"], "camera.fault"),
    "fusion: rate": (FUSED, ["estimator.platform_tag.rate=99"],
        "platform_tag.rate: found 99; accepted: at most 30"),
    "fusion: motion": (FUSED, [MOVING], "does not rest"),
    "fusion: plane": (FUSED, ["robot=planar"], "planar"),
    "fusion: sources": (FUSED, NO_SOURCES, "found no source"),
    "fusion: doubt": (FUSED, [f"{FUSION}.external_doubt={{position: 0.003}}"],
        "external_doubt.position: found 0.003; accepted: more than external_position"),
    "estimator": (PBVS, ["estimator.kind=control_integraton"],
        "accepted: one of control_integration"),
    "no known tag": (PBVS, ["estimator.kind=known_tag"], "estimator.known_tag: found none"),
    "tag of the target": (PBVS, [KNOWN_TAG.replace("tag_id: 7", "tag_id: 0")],
        "that of the target"),
    "compared twice": (PBVS, ["estimator.compare=[fusion, fusion]"], "found fusion twice"),
    "compared, misspelt": (PBVS, ["estimator.compare=[fussion]"],
        "found fussion; did you mean fusion"),
    "no list": (PBVS, ["estimator.compare=fusion"],
        "found fusion; accepted: a list of control_integration"),
    "fusion, misspelt": (PBVS, ["estimator.fusion.legnth=1"], "did you mean length"),
    "sensor": (PBVS, ["sensors.tension=vlu580"], "accepted: one of ideal, tractel, vlu850"),
    "first image, motion": (PBVS, [MOVING, "estimator.kind=first_image"],
        "estimator.kind: found first_image, but the target moves, so what differs"),
    "images, motion": (PBVS, [MOVING, "estimator.compare=[consecutive_images]"],
        "estimator.compare[0]: found consecutive_images, but the target moves"),
    "images of circles": (PBVS,
        ["target.kind=circles", "controller.scheme=circles", "estimator.kind=first_image"],
        "circles do not show their rotation"),
    "sight mount": (*managed("{kind: image, sight_mount: onboard}"), "sight_mount: found onboard"),
    "sight rate": (*managed("{kind: image, sight_rate: 100}"),
        "sight_rate: found 100; accepted: at most 30"),
    "closing time": (*managed("{kind: image, closing_time: 0}"), "closing_time"),
    "high threshold": (*managed("{threshold: [60]}"),
        "threshold: found 60; accepted: below 60 [N]"),
    "negative threshold": (*managed("{threshold: [1, 1, -0.5, 1, 1, 1, 1, 1]}"),
        "threshold: found -0.5; accepted: at least 0"),
    "negative highest": (*managed("{kind: by_length, highest: [-3], shortest: 1, longest: 2}"),
        "highest: found -3; accepted"),
    "two thresholds": (*managed("{threshold: [1, 2]}"),
        "threshold: found 2 values; accepted: one, or one for each of"),
    "nine thresholds": (*managed("{threshold: [1, 1, 1, 1, 1, 1, 1, 1, 1]}"),
        "threshold: found 9 values"),
    "thresholds distributed": (*managed(f"{{kind: distribution, threshold: {EIGHT}}}"),
        "accepted: one, by kind"),
    "negative distribution": (*managed("{kind: distribution, threshold: [-1]}"),
        "threshold: found -1; accepted: at least 0"),
    "reference": (*managed("{kind: distribution, method: reference_program}"),
        "tension_management.method"),
    "thresholds of a polygon": (*managed(f"{{kind: polygon, threshold: {EIGHT}}}"),
        "accepted: one, by kind polygon"),
    "margin": (*managed("{kind: polygon, margin: 30}"),
        "margin: found 30; accepted: at most 29.5 [N], half"),
    "negative margin": (*managed("{kind: polygon, margin: -1}"),
        "margin: found -1; accepted: a number >= 0 [N]"),
    "set point": (*managed("{kind: polygon, set_point: kernel}"),
        "tension_management.set_point: kernel: found red"),
    "negative polygon": (*managed("{kind: polygon, threshold: [-1]}"),
        "threshold: found -1; accepted: at least 0"),
    "negative gain": (*managed("{gain: -0.04}"), "gain: found -0.04"),
    "gain per length": (*managed("{kind: adaptive, gain_per_length: -1}"),
        "gain_per_length: found -1"),
    "slowness": (*managed("{kind: length, slowness: 0.5}"), "slowness: found 0.5"),
    "no highest": (*managed("{kind: by_length}"), "highest: found none; accepted: a number"),
    "lengths": (*managed("{kind: by_length, highest: [3], shortest: 2, longest: 1}"),
        "longest: found 1"),
    "low highest": (*managed("{kind: by_length, highest: [0.5], shortest: 1, longest: 2}"),
        "not below threshold"),
    "exponential": (*managed("{kind: by_length, threshold: [0], highest: [1], shortest: 1, "
        "longest: 2, shape: exponential}"), "threshold: found 0; accepted: above 0"),
    "management": (*managed("{kind: magic}"), "kind: found magic; accepted: one of constant"),
    "no rate": (*managed("{rate: 0}"), "rate: found 0"),
    "rate and step": (SLACK_START,
        [PROJECTED, "tension_management={rate: 300}", "integration.max_step=0.001"],
        "rate: found 300; accepted: a whole number of steps"),
    "torque: step": (*servo("torque_control.rate=1500", "integration.max_step=0.001"),
        "torque_control.rate: found 1500; accepted: a whole number of steps"),
    "torque: rate": (*servo("torque_control.rate=10"),
        "torque_control.rate: found 10; accepted: at least"),
    "torque: gain": (*servo("torque_control.proportional=-1"),
        "torque_control.proportional: found -1; accepted: a number >= 0"),
    "torque: derivative": (*servo("torque_control.derivative=0"),
        "torque_control.derivative: found 0; accepted: a number > 0 [N s/m]"),
    "torque: margin": (*servo("torque_control.margin=40"),
        "torque_control.margin: found 40 with limits 1 to 60 N"),
    "torque: slack": (*servo("torque_control.slack_below=2"),
        "torque_control.slack_below: found 2; accepted: at most 0.5 [N]"),
    "torque: kernel": (*servo("torque_control.method=kernel"),
        "torque_control.method: kernel: found redundancy"),
    "torque: reference": (*servo("torque_control.method=reference_program"),
        "reference_program: found no reference"),
    "torque by velocity": (*servo("winches.mode=velocity"),
        "torque_control: found a section with winches.mode velocity; accepted: null"),
    "ideal winches": (*servo("winches.kind=ideal"),
        "winches.mode: found torque with ideal winches"),
    "torque and management": (*servo("tension_management={}"),
        "tension_management: found a section with winches.mode torque"),
    "no platform tag": (*servo("estimator.kind=eye_to_hand"),
        "estimator.platform_tag: found none"),
    "platform tag's mount": (*servo(f"estimator={{{MOUNTED}}}"),
        "estimator.platform_tag.mount: 'onboard' is not in the world"),
    "plan and trajectory": (*servo("pose_plan={}", "trajectory={}"),
        "trajectory: found a section with pose_plan"),
    "plan, free rotation": (*servo("pose_plan={}", "controller.free_rotation=true"),
        "controller.free_rotation: found true with pose_plan"),
    "plan: speed": (*servo("pose_plan={speed: 0}"),
        "pose_plan.speed: found 0; accepted: a number > 0"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_a_scenario_without_sense_is_refused(case):
    name, changes, words = REFUSED[case]
    with pytest.raises(ScenarioError) as refused:
        load_scenario(name, changes)
    message = str(refused.value)
    assert words in message
    lines = message.splitlines()
    assert len(lines) == FAULTS.get(case, 1)
    assert all(len(line) <= 500 for line in lines)


FAULTS = {"fusion: motion": 2, "fusion: plane": 3}
"""Scenarios with several faults, one a line."""


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
        ["with 3 winches for 6 cables; accepted for a visual servo: at least 6",
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
    assert "winches.kind: found motor" in message
    assert "winch.inertia" in message


def test_prediction_refuses_forces_alone():
    home = load_robot("acrobot_large").home.transform()
    ahead = PredictiveTensions(PoseTrajectory((home, home), (1.0,)), 5)
    with pytest.raises(PlanningError, match="balance: found force; accepted by predictive: wrench"):
        dynamic_control(balance="force", distributor=ahead)


def test_a_distributor_of_a_user_s_is_no_loop_of_kernels():
    class Own(TensionDistributor):
        pass

    control = dynamic_control(distributor=Own)
    assert not can_be_compiled(control)
    with pytest.raises(CdprError, match="acrobot_large: found a plant, a distributor"):
        TensionLoop(control, 100.0)
