"""Scenario files: published case studies, overrides, kinds, engines, and what a new user runs."""

import shutil
from importlib import import_module

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import ScenarioError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot, names_mechanism, robot_file
from cdpr_drake.schema.yaml_files import FILE_KINDS
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.mechanism_control import build_mechanism_follower
from cdpr_drake.systems.scenarios.files import (
    KINDS,
    VISUAL_SERVO,
    robot_scenario_names,
    scenario_file,
    scenario_kind,
    scenario_names,
)
from cdpr_drake.systems.scenarios.run_settings import engine_of, set_engine
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO, Scenario

ROUND_OFF = 1e-12  # of poses with entries of order one
PRINTED_DIGIT = 5e-4  # half of the last digit of the printed positions [m]
SAME_ERROR = 1e-5  # tension correction winds up what carries nothing; final errors [m]
ARM, BASES = "cable_arm_computed_torque", "mobile_bases_winches"
TORQUE = "acrobot_computed_torque"


# Files and kinds.


def test_every_scenario_has_one_kind_and_loads_under_its_own_name():
    assert sorted(name for kind in KINDS for name in scenario_names(kind)) == list(scenario_names())
    assert {"acrobot_pbvs", "caroca_pbvs", "planar_pbvs"} <= set(scenario_names(VISUAL_SERVO))
    assert set(scenario_names()) - set(robot_scenario_names()) == {ARM, BASES}
    for name in scenario_names(VISUAL_SERVO):
        scenario = load_scenario(name)
        assert scenario.name == name
        assert scenario.title
        assert scenario.source
    assert isinstance(load_scenario("acrobot_pbvs"), Scenario)


def test_a_file_without_kind_is_a_visual_servo(tmp_path):
    path = tmp_path / "mine.yaml"
    for content in ("name: x\n", "[1, 2]\n", "a: [1\n", ""):
        path.write_text(content)
        assert scenario_kind(str(path)) == "visual_servo", content
    path.write_text("name: x\nkind: tension_control\n")
    assert scenario_kind(str(path)) == "tension_control"


def test_a_robot_of_one_s_own_lies_beside_the_scenario(tmp_path):
    path, text = tmp_path / "mine.yaml", scenario_file("acrobot_pbvs").read_text()
    path.write_text(text)
    assert load_scenario(str(path)).robot == "acrobot_small"
    content = yaml.safe_load(robot_file("acrobot_small").read_text())
    content["platform"]["mass"] = 2.0
    (tmp_path / "heavier.yaml").write_text(yaml.safe_dump(content))
    path.write_text(text.replace("robot: acrobot_small", "robot: heavier.yaml"))
    assert load_robot(load_scenario(str(path)).robot).platform.mass == 2.0


def test_a_mechanism_is_found_beside_the_file(tmp_path):
    shutil.copytree(robot_file("cable_arm").parent, tmp_path / "mine")
    path = tmp_path / "held.yaml"
    path.write_text(
        "kind: mechanism\nname: held\nmechanism: ./mine\nduration: 1.0\n"
        "motion: {waypoints: [{time: 1.0, joints: {elbow: 0}}]}\ncontrol: {kind: winches}\n"
    )
    assert not names_mechanism(path)  # though it has the key mechanism
    assert load_scenario(str(path)).mechanism == str(tmp_path / "mine")


def test_joints_stay_where_they_were_before():
    ways = "[{time: 1.0, joints: {elbow: 0.6}}, {time: 2.0, joints: {shoulder: 0.3}}]"
    motion = build_mechanism_follower(load_scenario(ARM, [f"motion.waypoints={ways}"])).motion
    np.testing.assert_allclose(motion.positions, [[0.2, 0.4], [0.2, 0.6], [0.3, 0.6]])


@pytest.mark.parametrize("what", FILE_KINDS)
def test_the_loader_that_is_told_for_a_kind_of_file_can_be_imported(what):
    module, name = FILE_KINDS[what][1].rsplit(".", 1)
    assert callable(getattr(import_module(module), name))


# Published values.


@pytest.mark.parametrize(
    ("name", "robot", "position", "angles", "distance", "gains", "platform"),
    [
        ("acrobot_pbvs", "acrobot_small", (0.112, -0.032, 0.301), (-12.0, -10.0, 0.0), 0.09,
         (2.0, 0.3, 30.0), (0.284, -0.197, 0.08)),
        ("caroca_pbvs", "caroca", (0.322, 0.17, 2.018), (-20.0, 7.0, -3.0), 0.6,
         (1.5, 0.1, 30.0), (-0.827, -1.392, 0.89)),
    ],
)  # fmt: skip
def test_case_study_has_the_published_values(
    name, robot, position, angles, distance, gains, platform
):
    """Servoing thesis 2.3.2 and 2.3.4, case study I; the tag lies where the printed desired poses
    put it, X_WP* X_PC X_CO* = X_WO, flat on the ground with its face up."""
    scenario = load_scenario(name)
    assert scenario.robot == robot
    np.testing.assert_array_equal(scenario.initial_pose.position, position)
    np.testing.assert_array_equal(scenario.initial_pose.angles_deg, angles)
    np.testing.assert_array_equal(scenario.desired.position, [0.0, 0.0, distance])
    np.testing.assert_array_equal(scenario.desired.angles_deg, [180.0, 0.0, 180.0])
    control = scenario.controller
    assert (control.lambda_0, control.lambda_infinity, control.lambda_slope) == gains
    X_PC = load_robot(robot).camera_mount(scenario.camera.mount).pose.transform()
    X_WP, X_WO = pose_from_angles(np.array(platform), np.zeros(3)), scenario.target.pose.transform()
    off, angle = pose_error(X_WP @ X_PC @ scenario.desired.transform(), X_WO)
    assert off < PRINTED_DIGIT
    assert angle < ROUND_OFF
    assert scenario.target.pose.position[2] == 0.0
    np.testing.assert_allclose(X_WO.rotation().matrix()[:, 2], [0.0, 0.0, 1.0], atol=ROUND_OFF)


def test_planar_scenario_stays_in_the_plane():
    scenario = load_scenario("planar_pbvs")
    robot = load_robot(scenario.robot)
    X_PC = robot.camera_mount(scenario.camera.mount).pose.transform()
    X_WPd = scenario.target.pose.transform() @ (X_PC @ scenario.desired.transform()).inverse()
    assert X_WPd.translation()[2] == pytest.approx(robot.plane_height, abs=ROUND_OFF)
    np.testing.assert_allclose(X_WPd.rotation().matrix()[:, 2], [0.0, 0.0, 1.0], atol=ROUND_OFF)


# Overrides.


@pytest.mark.parametrize(
    ("overrides", "path", "value"),
    [
        (["controller.lambda_0=1.25"], "controller.lambda_0", 1.25),
        (["controller.sigma=null"], "controller.sigma", None),
        (["camera.kind=projected"], "camera.kind", "projected"),
        (["camera.latency_frames=2"], "camera.latency_frames", 2),
        (["seed=17"], "seed", 17),
        (["seed=1e3"], "seed", 1000),
        (["seed=010"], "seed", 10),
        (["seed=1", "camera.rate=50.0", "seed=2"], "seed", 2),
        (["seed=1", "camera.rate=50.0", "seed=2"], "camera.rate", 50.0),
        (["duration=1e1"], "duration", 10.0),
        (["perturbations.exit_points=0.01"], "perturbations.exit_points", 0.01),
        (["integration.max_step=1e-4"], "integration.max_step", 1e-4),
        (["initial_pose={position: [0.1, 0.0, 0.3], angles_deg: [1, 2, 3]}"],
         "initial_pose.angles_deg", [1.0, 2.0, 3.0]),
        (["perturbations.initial_pose.position=[0.1, 0.0, 0.3]"],  # makes the section
         "perturbations.initial_pose.position", [0.1, 0.0, 0.3]),
        (["perturbations.initial_pose.position=[0.1, 0.0, 0.3]"],  # with its defaults
         "perturbations.initial_pose.angles_deg", [0.0, 0.0, 0.0]),
        *(([f"title={words}"], "title", words) for words in ("5", "true", "on", "1.5", "no")),
    ],
)  # fmt: skip
def test_overrides_replace_values(overrides, path, value):
    """Also where YAML reads text as something else."""

    def read(scenario):
        for key in path.split("."):
            scenario = getattr(scenario, key) if scenario is not None else None
        return scenario.tolist() if isinstance(scenario, np.ndarray) else scenario

    assert read(load_scenario("acrobot_pbvs")) != value
    assert read(load_scenario("acrobot_pbvs", overrides)) == value


# Dynamic control.


@pytest.mark.parametrize("name", scenario_names("tension_control"))
def test_every_tension_scenario_loads_ends_in_time_and_can_balance_forces_alone(name):
    """By a method that takes the redundancy that it then has; force laws ask for moments too."""
    scenario = load_scenario(name)
    assert isinstance(scenario, TensionScenario)
    assert scenario.name == name
    assert scenario.trajectory.trajectory().end_time <= scenario.duration
    force = ["controller.balance=force", "distribution.method=quadratic_program"]
    if scenario.force_control is None:
        assert load_scenario(name, force).controller.balance == "force"
    else:
        with pytest.raises(ScenarioError, match="found force beside force_control"):
            load_scenario(name, force[:1])


def test_trajectory_limits_and_reference_are_those_of_the_file():
    scenario = load_scenario(
        TORQUE, ["distribution.method=reference_program", "distribution.reference=7"]
    )
    assert scenario.distribution.reference == 7.0
    assert scenario.limits() == (1.0, 60.0)
    trajectory = scenario.trajectory.trajectory()
    np.testing.assert_allclose(trajectory.pose(0.0).translation(), [0.0, 0.0, 0.2])
    np.testing.assert_allclose(trajectory.pose(3.5).translation(), [0.15, -0.1, 0.4], atol=1e-12)


def test_forces_alone_hold_poses_that_no_wrench_holds():
    """Towards a corner of the frame moments cannot be balanced any more, but forces."""
    away = ["trajectory.start.position=[0.45, 0.45, 0.6]", "distribution.method=quadratic_program"]
    with pytest.raises(ScenarioError, match="a pose that can be held"):
        load_scenario(TORQUE, away)
    scenario = load_scenario(TORQUE, [*away, "controller.balance=force"])
    np.testing.assert_array_equal(scenario.trajectory.start.position, [0.45, 0.45, 0.6])


def test_pulleys_are_simulated_and_believed_in_as_asked():
    robot, pulleys = load_robot("acrobot_large"), "cables.pulleys=true"
    for overrides, real, believed in (
        ([], False, False), ([pulleys], True, True),
        ([pulleys, "distribution.pulleys=false"], True, False),
    ):  # fmt: skip
        scenario = load_scenario(TORQUE, overrides)
        assert scenario.cable_set(robot).has_pulleys() == real
        assert scenario.believed_cables(robot).has_pulleys() == believed


# Engines.


@pytest.mark.parametrize("name", ["acrobot_pbvs", "planar_computed_torque"])
def test_long_and_repeated_runs_take_the_compiled_engine_and_say_so(name):
    short, long = (load_scenario(name, [f"duration={time}"]) for time in ("600", "600.1"))
    assert set_engine(short) == (short, "")
    assert engine_of(short) == "plant"
    for chosen, words in (set_engine(long), set_engine(short, repeated=True)):
        assert engine_of(chosen) == chosen.integration.engine == "compiled"
        assert words.startswith(f"{name}: by the compiled engine")
    for engine in ("plant", "compiled"):  # what is asked for is left
        asked = load_scenario(name, ["duration=1e4", f"integration.engine={engine}"])
        assert set_engine(asked, repeated=True) == (asked, "")
        assert engine_of(asked) == engine


# The scenario that a new user runs: case study I, with cables that stay taut.

QUICK = ["camera.kind=projected", "integration.engine=compiled"]


def described(scenario):
    """All that a run depends on."""
    return str({k: v for k, v in vars(scenario).items() if k not in ("name", "title", "source")})


def test_the_default_keeps_cables_taut_and_one_setting_makes_it_case_study_i():
    plain = load_scenario(DEFAULT_SCENARIO, ["tension_management=null"])
    assert described(plain) == described(load_scenario("acrobot_pbvs"))
    taut, slack = (
        ServoRun(load_scenario(name, QUICK)).simulate().as_dict()
        for name in (DEFAULT_SCENARIO, "acrobot_pbvs")
    )
    assert taut["outcome"] == slack["outcome"] == "converged"
    error = "final_position_error_m"
    assert taut[error] == pytest.approx(slack[error], abs=SAME_ERROR)
    assert taut["sim_time_s"] == pytest.approx(slack["sim_time_s"], abs=0.1)
    assert taut["taut_cables"] == {"min": 8, "end": 8}
    assert slack["taut_cables"]["end"] == 6
    assert slack["slack_cable_seconds"] > 10.0


@pytest.mark.parametrize(("gain", "converges"), [(0.003, True), (0.04, False)])
def test_its_gain_is_far_from_where_it_is_unstable(gain, converges):
    """Ten times its own; the published gain is for cables that give: with these it lifts the
    platform."""
    section = f"tension_management={{threshold: [0.5], gain: {gain}}}"
    result = ServoRun(load_scenario(DEFAULT_SCENARIO, [*QUICK, section])).simulate().as_dict()
    assert (result["outcome"] == "converged") == converges
