"""What no scenario may ask for is refused in one line that names the key, and all at once."""

import re

import numpy as np
import pytest
import yaml
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BallRpyJoint, SpatialInertia

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.analyses.runs.tension import TensionRun
from cdpr_drake.analyses.workspaces.stability_defaults import load_bounds
from cdpr_drake.errors import (
    CdprError,
    DataFileError,
    InfeasibleTensionError,
    RobotFileError,
    ScenarioError,
)
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.scenarios.files import (
    check_moves_robot,
    scenario_file,
    scenario_kind,
    scenario_names,
)
from cdpr_drake.systems.scenarios.mechanism_motion import plant_motion
from cdpr_drake.systems.scenarios.mechanism_scenario import Waypoint
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

ARM, BASES = "cable_arm_computed_torque", "mobile_bases_winches"
SERVO, TORQUE = "acrobot_pbvs", "acrobot_computed_torque"
LARGE = load_robot("acrobot_large")


def waypoint(words):
    return f"motion.waypoints=[{{time: 1.0, {words}}}]"


def start(position):
    return f"trajectory.start.position={list(position)}"


IN_PULLEY = start((LARGE.cables[0].exit_point - LARGE.cables[0].anchor_point).tolist())
FORCE = "controller.balance=force"
OUTSIDE = (
    "initial_pose.position: found (0.7, 0, 0.3), outside the frame; "
    "accepted: (-0.6, -0.6, 0) to (0.6, 0.6, 1.2) [m]"
)

REFUSED = {
    SERVO: {
        "stability={threshold: -1}": "stability.threshold: found -1",
        "camera.mount=ceiling": "camera.mount: found 'ceiling', which is not on the platform",
        "camera.mount=overview": "camera.mount: found 'overview', which is not on the",
        "initial_pose.position=[0.7, 0.0, 0.3]": OUTSIDE,
        "perturbations.initial_pose={position: [0.0, 0.0, -0.1]}": (
            "perturbations.initial_pose.position: found (0, 0, -0.1), outside the frame"
        ),
        "desired.position=[0.0, 0.0, 0.0]": "position: found (0, 0, 0); accepted: z > 0 [m]",
        "controller.lambda_infinity=3.0": "lambda_infinity: found 3; accepted: at most lambda_0",
        "expected.outcome=arrived": "expected.outcome: found arrived; accepted: one of",
        "integration.integrator=semi_implicit": "found semi_implicit with the engine plant",
        "integration.accuracy=1e-9": "accuracy: found 1e-09 with the engine plant",
        "integration.engine=mujoco": "engine: found mujoco; accepted: one of automatic",
        "seed": "overrides seed: accepted: key=value",
        "=1": "overrides =1: accepted: key=value",
        "sead=1": "overrides sead: there is no key sead in the scenario; did you mean seed?",
        "camera.knd=projected": "there is no key knd in camera; did you mean kind?",
        "seed.more=1": "overrides seed.more: seed has no keys of its own",
        "seed=1.5": "overrides seed: found 1.5; accepted: a whole number >= 0",
        "seed=-1": "overrides seed: found -1; accepted: a whole number >= 0",
        "duration=nan": "overrides duration: found nan; accepted: a number > 0 [s]",
        "duration=": "overrides duration: found null; accepted: a number > 0 [s]",
        "duration=[": "overrides duration: found '[', which is not YAML",
        "camera.kind=painted": "overrides camera.kind: found painted; accepted: one of rendered",
        "controller.scheme=ibsv": "found ibsv; did you mean ibvs? accepted: one of pbvs",
        "target.tag_id=587": "overrides target.tag_id: found 587; accepted: a whole number >= 0",
        "initial_pose.position=[0.1, 0.2]": "overrides initial_pose.position: found [0.1, 0.2]",
        "integration.integrator=euler": "overrides integration.integrator: found euler",
    },
    "planar_pbvs": {
        "initial_pose.position=[0.0, 0.0, 0.31]": (
            "initial_pose: found (0, 0, 0.31) m, (0, 0, -15) deg; "
            "accepted: z = 0.3 m, phi = theta = 0"
        ),
        "initial_pose.angles_deg=[1.0, 0, 0]": "accepted: z = 0.3 m, phi =",
        "perturbations.initial_pose={position: [0, 0, 0.1], angles_deg: [30, 0, 0]}": (
            "perturbations.initial_pose"
        ),
    },
    TORQUE: {
        "distribution.method=foo": "distribution.method: found foo",
        "distribution.method=kernel": "trajectory.start: kernel: found redundancy",
        "distribution.method=reference_program": "no reference",
        "distribution.limits=[9, 3]": "lower <= upper",
        "distribution.limits=[1]": "2 numbers",
        "trajectory.start.position=[0, 0, 9]": "outside the frame",
        "trajectory.start.position=[0.55, 0.55, 1.1]": "a pose that can be held",
        "trajectory.stretches=[]": "at least one",
        "trajectory.stretches=[{pose: {position: [0, 0, 0.2]}, duration: 0}]": "found 0",
        "controller.stiffness=-1": "found -1",
        "controller.balance=moment": (
            "controller.balance: found moment; accepted: one of wrench, force"
        ),
        "kind=visual_servo": "kind: found visual_servo",
        "camera.kind=rendered": "no key camera",
        "robot=foo": "foo",
        (FORCE, "distribution.method=barycenter"): (
            "barycenter: found redundancy m - n = 5; accepted: 2"
        ),
        (FORCE, "distribution.method=quadratic_program", "predictive={steps: 5}"): (
            "controller.balance: found force beside predictive; accepted"
        ),
        ("cables.pulleys=true", IN_PULLEY): re.compile(r"trajectory\.start: .*pulley"),
    },
    ARM: {
        "motion.waypoints=[]": "motion.waypoints: found none; accepted: at least one",
        "motion.waypoints=[{time: 1.0}, {time: 0.5}]": (
            "motion.waypoints[1].time: found 0.5; accepted: above 1 [s]"
        ),
        waypoint("joints: {knee: 1}"): "joints.knee: found knee; accepted: one of",
        waypoint("joints: {elbow: 2.5}"): "joints.elbow: found 2.5; accepted: within",
        waypoint("joints: {elbow: [1, 2]}"): "joints.elbow: found 2 numbers; accepted: 1",
        waypoint("bodies: {upper: {position: [0, 0, 0]}}"): "bodies.upper: found upper",
        "control.kind=magic": "control.kind: found magic",
        "control.kp=-1": "control.kp: found -1",
        "control.limits=[9, 3]": "control.limits: found [9.0, 3.0]; accepted: lower <",
        "control.method=kernel": "control.method: kernel: found redundancy",
        "control.method=reference_program": "control.prestress: found null",
        "control.prestress=20": "control.prestress: found 20; accepted: null with",
        ("control.limits=[2, 20]", waypoint("joints: {elbow: 1.5}")): (
            "motion.waypoints[0]: found positions where no tensions within 2..20 N"
        ),
        "integration.engine=compiled": "engine: found compiled; accepted: plant",
        "cables.model=elastic": "cables.model: found elastic; accepted: with winches",
        "cables.stiffness_ratio=0.5": "cables.stiffness_ratio: found 0.5",
        "mechanism=cable_leg": "mechanism: found 'cable_leg'; did you mean cable_arm",
        "mechanism=planar": "mechanism: found 'planar'; known: arm_on_platform, bm_arm",
        "robot=planar": "no key robot",
    },
    BASES: {
        "control.method=kernel": "control.method: found kernel; accepted: with comp",
        "cables.model=catenary": "cables.model: hang: found cables by the model cat",
        "control.limits=[200, 210]": "control: at the start, ",
    },
}
ROWS = [
    (name, [key] if isinstance(key, str) else list(key), words)
    for name, rows in REFUSED.items()
    for key, words in rows.items()
]


@pytest.mark.parametrize(("name", "overrides", "words"), ROWS)
def test_what_is_asked_for_is_refused(name, overrides, words):
    pattern = words if isinstance(words, re.Pattern) else re.escape(words)
    with pytest.raises(CdprError, match=pattern) as caught:
        load_scenario(name, overrides)
    message = str(caught.value)
    assert scenario_file(name).name in message or message.startswith("overrides ")
    assert "\n" not in message


def run_other(run, name):
    return lambda: run(load_scenario(name))


def ball_joint(*waypoints):
    """The motion of a joint whose velocities are not rates of its positions."""
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidSphereWithMass(1.0, 0.2))
    plant.AddJoint(BallRpyJoint("ball", plant.world_frame(), body.body_frame()))
    plant.Finalize()
    return plant_motion(plant, np.full(3, 0.2), list(waypoints))


OTHERS = {
    "unknown scenario": (lambda: load_scenario("acrobot_pvbs"), "did you mean acrobot_pbvs?"),
    "every name": (lambda: load_scenario("acrobot_pvbs"), ".*".join(scenario_names())),
    "every kind": (lambda: scenario_kind("foo"), "acrobot_computed_torque.*acrobot_pbvs"),
    "missing file": (lambda: load_scenario("/no/a.yaml"), "^/no/a.yaml: there is no such scenario"),
    "no runner of torque": (
        run_other(ServoRun, "planar_computed_torque"),
        "found tension_control; accepted: visual_servo",
    ),
    "no runner of servos": (
        run_other(TensionRun, "planar_pbvs"), r"found visual_servo; accepted: tension_control"
    ),
    "schema of servos": (
        lambda: load_scenario("planar_computed_torque", schema=Scenario),
        "found tension_control, not described by Scenario",
    ),
    "schema of torque": (
        lambda: load_scenario(SERVO, schema=TensionScenario),
        "found visual_servo, not described by TensionScenario",
    ),
    "mechanism": (
        lambda: check_moves_robot(ARM, "cdpr serve"),
        "found mechanism; accepted by cdpr serve: kinds",
    ),
    "ball joint": (
        lambda: ball_joint(Waypoint(time=1.0, joints={"ball": np.zeros(3)})),
        "found a joint of the type ball_rpy; accepted: revol",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("call", "words"), OTHERS.values(), ids=OTHERS)
def test_refusal(call, words):
    with pytest.raises(ScenarioError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_a_ball_joint_may_stay_and_a_robot_may_be_served():
    assert not np.any(ball_joint(Waypoint(time=1.0)).at(0.5)[1])
    check_moves_robot(SERVO, "cdpr serve")


def test_unknown_robot_names_scenario_and_robots():
    with pytest.raises(RobotFileError, match=r"did you mean acrobot_small\?") as caught:
        load_scenario(SERVO, ["robot=acrobot_smal"])
    assert "acrobot_pbvs.yaml: robot: robot 'acrobot_smal' is unknown" in str(caught.value)


@pytest.mark.parametrize(
    ("load", "text", "words"),
    [
        (load_scenario, "speed: 1.0", "speed: unknown key; "),
        (scenario_kind, "kind: dance", "kind: found dance; accepted: one of"),
    ],
)
def test_a_line_of_a_file_is_named(load, text, words, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(scenario_file(SERVO).read_text() + f"{text}\n")
    line = len(path.read_text().splitlines())
    with pytest.raises(ScenarioError) as caught:
        load(str(path))
    assert str(caught.value).startswith(f"{path}:{line}: {words}")
    assert "\n" not in str(caught.value)


def test_all_problems_of_a_scenario_are_said_at_once(tmp_path):
    content = yaml.safe_load(scenario_file(SERVO).read_text())
    content["robot"] = "acrobat_small"
    content["controller"]["lambda_0"] = -1.0
    del content["title"], content["desired"]
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    wrong = [
        "camera.mount=nose", "initial_pose.position=[0, 0, 9]", "sensors.log=[tension, tension]",
        "controller.lambda_infinity=9",
    ]  # fmt: skip
    of_robot = ["camera.mount", "initial_pose.position", "controller.lambda_infinity"]
    for name, overrides, keys in (
        (str(path), [], ["desired", "controller.lambda_0", "robot"]),
        (SERVO, wrong, [*of_robot, "sensors.log"]),
    ):
        with pytest.raises(ScenarioError) as caught:
            load_scenario(name, overrides)
        parts = [problem.split(": ") for problem in caught.value.problems]
        found = [where.removeprefix("overrides ") if overrides else key for where, key, *_ in parts]
        assert sorted(found) == sorted(keys)


@pytest.mark.parametrize(
    ("load", "file", "words"),
    [
        (load_scenario, robot_file("planar"), "found a robot; use cdpr_drake.models.load_robot"),
        (load_robot, scenario_file("planar_pbvs"), "found a scenario; use cdpr_drake.systems.load"),
        (load_robot, scenario_file("planar_computed_torque"), "found a scenario; use"),
        (load_bounds, robot_file("planar"), "found a robot; use cdpr_drake.models.load_robot"),
    ],
)
def test_a_file_of_another_kind_is_told_with_its_loader(load, file, words):
    with pytest.raises(DataFileError) as caught:
        load(file if load is load_bounds else str(file))
    (problem,) = caught.value.problems
    assert problem.startswith(f"{file}: {words}")


def test_a_pose_that_the_cables_cannot_hold_is_refused_at_the_start():
    """In the corner of the frame, beside the area that the exit points span."""
    overrides = ["camera.kind=projected", "initial_pose.position=[0.58, 0.58, 1.1]"]
    servo = build_visual_servo(load_scenario(SERVO, overrides))
    with pytest.raises(InfeasibleTensionError) as caught:
        servo.make_context()
    message = str(caught.value)
    assert message.startswith("acrobot_small cannot hold the platform at (0.58, 0.58, 1.1) m: ")
    assert "0..60 N" in message
    assert "\n" not in message
