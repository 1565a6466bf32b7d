"""Scenario files: the published case studies, and refusals that say what is wrong."""

from importlib.resources import files

import numpy as np
import pytest
import yaml

from cdpr_drake.errors import InfeasibleTensionError, RobotFileError, ScenarioError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.systems.scenarios.files import VISUAL_SERVO, scenario_names

ROUND_OFF = 1e-12
"""Of poses with entries of order one."""

PRINTED_DIGIT = 5e-4
"""Half of the last digit of the printed positions [m]."""


def test_every_scenario_loads_under_its_own_name():
    assert {"acrobot_pbvs", "caroca_pbvs", "planar_pbvs"} <= set(scenario_names(VISUAL_SERVO))
    for name in scenario_names(VISUAL_SERVO):
        scenario = load_scenario(name)
        assert scenario.name == name
        assert scenario.title
        assert scenario.source


@pytest.mark.parametrize(
    ("name", "robot", "position", "angles_deg", "distance", "gains"),
    [
        (
            "acrobot_pbvs",
            "acrobot_small",
            (0.112, -0.032, 0.301),
            (-12.0, -10.0, 0.0),
            0.09,
            (2.0, 0.3, 30.0),
        ),
        (
            "caroca_pbvs",
            "caroca",
            (0.322, 0.17, 2.018),
            (-20.0, 7.0, -3.0),
            0.6,
            (1.5, 0.1, 30.0),
        ),
    ],
)
def test_case_study_has_the_published_values(name, robot, position, angles_deg, distance, gains):
    """Servoing thesis 2.3.2 and 2.3.4, case study I."""
    scenario = load_scenario(name)
    assert scenario.robot == robot
    np.testing.assert_array_equal(scenario.initial_pose.position, position)
    np.testing.assert_array_equal(scenario.initial_pose.angles_deg, angles_deg)
    np.testing.assert_array_equal(scenario.desired.position, [0.0, 0.0, distance])
    np.testing.assert_array_equal(scenario.desired.angles_deg, [180.0, 0.0, 180.0])
    controller = scenario.controller
    found = (controller.lambda_0, controller.lambda_infinity, controller.lambda_slope)
    assert found == gains


@pytest.mark.parametrize(
    ("name", "desired_platform"),
    [("acrobot_pbvs", (0.284, -0.197, 0.08)), ("caroca_pbvs", (-0.827, -1.392, 0.89))],
)
def test_tag_lies_where_the_printed_desired_poses_put_it(name, desired_platform):
    """X_WP* X_PC X_CO* = X_WO; servoing thesis 2.3.2 and 2.3.4, desired pose without turn."""
    scenario = load_scenario(name)
    X_PC = load_robot(scenario.robot).camera_mount(scenario.camera.mount).pose.transform()
    X_WP = pose_from_angles(np.array(desired_platform), np.zeros(3))
    X_WO = X_WP @ X_PC @ scenario.desired.transform()
    distance, angle = pose_error(X_WO, scenario.target.pose.transform())
    assert distance < PRINTED_DIGIT
    assert angle < ROUND_OFF
    # Flat on the ground, with its face up.
    assert scenario.target.pose.position[2] == 0.0
    up = scenario.target.pose.transform().rotation() @ np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(up, [0.0, 0.0, 1.0], atol=ROUND_OFF)


def test_planar_scenario_stays_in_the_plane():
    scenario = load_scenario("planar_pbvs")
    robot = load_robot(scenario.robot)
    X_PC = robot.camera_mount(scenario.camera.mount).pose.transform()
    X_WPd = scenario.target.pose.transform() @ (X_PC @ scenario.desired.transform()).inverse()
    assert X_WPd.translation()[2] == pytest.approx(robot.plane_height, abs=ROUND_OFF)
    upright = X_WPd.rotation().matrix()[:, 2]
    np.testing.assert_allclose(upright, [0.0, 0.0, 1.0], atol=ROUND_OFF)


def text_of(name):
    """The YAML text of a scenario that comes with the package."""
    return files("cdpr_drake.systems").joinpath(f"scenarios/{name}.yaml").read_text("utf-8")


def refusal(name, overrides=(), error=ScenarioError):
    """The one line that loading a scenario raises."""
    with pytest.raises(error) as caught:
        load_scenario(str(name), overrides)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_a_scenario_loads_by_path(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(text_of("acrobot_pbvs"), encoding="utf-8")
    assert load_scenario(str(path)).robot == "acrobot_small"


def test_a_robot_of_one_s_own_lies_beside_the_scenario(tmp_path):
    robot = files("cdpr_drake.models").joinpath("robots/acrobot_small/robot.yaml")
    content = yaml.safe_load(robot.read_text("utf-8"))
    content["platform"]["mass"] = 2.0
    (tmp_path / "heavier.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    path = tmp_path / "mine.yaml"
    text = text_of("acrobot_pbvs").replace("robot: acrobot_small", "robot: heavier.yaml")
    path.write_text(text, encoding="utf-8")
    assert load_robot(load_scenario(str(path)).robot).platform.mass == 2.0


def test_unknown_scenario_says_which_exist():
    message = refusal("acrobot_pvbs")
    assert "did you mean acrobot_pbvs?" in message
    assert all(name in message for name in scenario_names())


def test_missing_file_is_named(tmp_path):
    message = refusal(tmp_path / "absent.yaml")
    assert message == f"{tmp_path / 'absent.yaml'}: there is no such scenario file"


def test_unknown_robot_names_scenario_and_robots():
    message = refusal("acrobot_pbvs", ["robot=acrobot_smal"], RobotFileError)
    assert "acrobot_pbvs.yaml: robot: robot 'acrobot_smal' is unknown" in message
    assert "did you mean acrobot_small?" in message


def test_unknown_key_in_a_file_is_named_with_its_line(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(text_of("acrobot_pbvs") + "speed: 1.0\n", encoding="utf-8")
    line = len(path.read_text(encoding="utf-8").splitlines())
    assert refusal(path).startswith(f"{path}:{line}: speed: unknown key; ")


REFUSED = {
    "unknown mount": (["camera.mount=ceiling"], "camera.mount: 'ceiling' is not on the platform"),
    "mount of the world": (["camera.mount=overview"], "camera.mount: 'overview' is not on the"),
    "initial pose outside": (
        ["initial_pose.position=[0.7, 0.0, 0.3]"],
        "initial_pose.position: found (0.7, 0, 0.3), outside the frame; "
        "accepted: (-0.6, -0.6, 0) to (0.6, 0.6, 1.2) [m]",
    ),
    "believed pose outside": (
        ["perturbations.initial_pose={position: [0.0, 0.0, -0.1]}"],
        "perturbations.initial_pose.position: found (0, 0, -0.1), outside the frame",
    ),
    "tag desired behind the camera": (
        ["desired.position=[0.0, 0.0, 0.0]"],
        "desired.position: found (0, 0, 0); accepted: z > 0 [m]",
    ),
    "gain that grows with the error": (
        ["controller.lambda_infinity=3.0"],
        "controller.lambda_infinity: found 3; accepted: at most lambda_0 = 2 [1/s]",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_the_robot_cannot_do_is_refused(case):
    overrides, expected = REFUSED[case]
    message = refusal("acrobot_pbvs", overrides)
    assert f"acrobot_pbvs.yaml: {expected}" in message


@pytest.mark.parametrize(
    "override", ["initial_pose.position=[0.0, 0.0, 0.31]", "initial_pose.angles_deg=[1.0, 0, 0]"]
)
def test_a_planar_robot_starts_in_its_plane(override):
    message = refusal("planar_pbvs", [override])
    assert "initial_pose: found " in message
    assert "accepted for the planar planar: z = 0.3 m, phi = theta = 0" in message


@pytest.mark.parametrize(
    ("override", "value"),
    [
        ("controller.lambda_0=1.25", lambda s: s.controller.lambda_0 == 1.25),
        ("controller.sigma=null", lambda s: s.controller.sigma is None),
        ("camera.kind=projected", lambda s: s.camera.kind == "projected"),
        ("camera.latency_frames=2", lambda s: s.camera.latency_frames == 2),
        ("seed=17", lambda s: s.seed == 17),
        ("perturbations.exit_points=0.01", lambda s: s.perturbations.exit_points == 0.01),
        (
            "initial_pose={position: [0.1, 0.0, 0.3], angles_deg: [1, 2, 3]}",
            lambda s: s.initial_pose.angles_deg.tolist() == [1.0, 2.0, 3.0],
        ),
        ("integration.max_step=1e-4", lambda s: s.integration.max_step == 1e-4),
    ],
)
def test_overrides_replace_values(override, value):
    assert not value(load_scenario("acrobot_pbvs"))
    assert value(load_scenario("acrobot_pbvs", [override]))


def test_an_override_makes_the_sections_that_it_needs():
    assert load_scenario("acrobot_pbvs").perturbations.initial_pose is None
    override = "perturbations.initial_pose.position=[0.1, 0.0, 0.3]"
    believed = load_scenario("acrobot_pbvs", [override]).perturbations.initial_pose
    np.testing.assert_array_equal(believed.position, [0.1, 0.0, 0.3])
    np.testing.assert_array_equal(believed.angles_deg, np.zeros(3))


def test_overrides_add_up():
    scenario = load_scenario("acrobot_pbvs", ["seed=1", "camera.rate=50.0", "seed=2"])
    assert (scenario.seed, scenario.camera.rate) == (2, 50.0)


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("seed", "overrides seed: accepted: key=value"),
        ("=1", "overrides =1: accepted: key=value"),
        ("sead=1", "overrides sead: there is no key sead in the scenario; did you mean seed?"),
        ("camera.knd=projected", "there is no key knd in camera; did you mean kind?"),
        ("seed.more=1", "overrides seed.more: seed has no keys of its own"),
        ("seed=1.5", "overrides seed: found 1.5; accepted: a whole number >= 0"),
        ("seed=-1", "overrides seed: found -1; accepted: a whole number >= 0"),
        ("duration=nan", "overrides duration: found nan; accepted: a number > 0 [s]"),
        ("duration=", "overrides duration: found null; accepted: a number > 0 [s]"),
        ("duration=[", "overrides duration: found '[', which is not YAML"),
        ("camera.kind=painted", "overrides camera.kind: found painted; accepted: one of rendered"),
        (
            "controller.scheme=ibsv",
            "found ibsv; did you mean ibvs? accepted: one of pbvs",
        ),
        ("target.tag_id=587", "overrides target.tag_id: found 587; accepted: a whole number >= 0"),
        ("initial_pose.position=[0.1, 0.2]", "overrides initial_pose.position: found [0.1, 0.2]"),
        ("integration.integrator=euler", "overrides integration.integrator: found euler"),
    ],
)
def test_bad_overrides_are_refused(override, expected):
    assert expected in refusal("acrobot_pbvs", [override])


def test_a_pose_that_the_cables_cannot_hold_is_refused_at_the_start():
    """In the corner of the frame, beside the area that the exit points span."""
    overrides = ["camera.kind=projected", "initial_pose.position=[0.58, 0.58, 1.1]"]
    servo = build_visual_servo(load_scenario("acrobot_pbvs", overrides))
    with pytest.raises(InfeasibleTensionError) as caught:
        servo.make_context()
    message = str(caught.value)
    assert message.startswith("acrobot_small cannot hold the platform at (0.58, 0.58, 1.1) m: ")
    assert "0..60 N" in message
    assert "\n" not in message


def test_numbers_load_as_they_were_checked():
    assert load_scenario("acrobot_pbvs", ["seed=1e3"]).seed == 1000
    assert load_scenario("acrobot_pbvs", ["seed=010"]).seed == 10
    assert load_scenario("acrobot_pbvs", ["duration=1e1"]).duration == 10.0


@pytest.mark.parametrize("words", ["5", "true", "on", "1.5", "no"])
def test_text_that_yaml_reads_as_something_else_stays_text(words):
    assert load_scenario("acrobot_pbvs", [f"title={words}"]).title == words


def test_planar_estimate_off_its_plane_is_refused():
    pose = "perturbations.initial_pose={position: [0, 0, 0.1], angles_deg: [30, 0, 0]}"
    with pytest.raises(ScenarioError, match=r"perturbations\.initial_pose"):
        load_scenario("planar_pbvs", [pose])
