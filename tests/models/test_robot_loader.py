"""Robot files: what is not a possible robot is refused, with a line that says what is wrong."""

import copy
import math
import re

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cdpr_drake.cli.check import checked
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot, point_notes, robot_file, robot_names

ROBOT = """\
name: crate
title: A crate on three cables
platform:
  mass: 2.0
  size: [0.2, 0.3, 0.1]
  center_of_mass: [0.0, 0.0, 0.04]
  inertia: [0.017, 0.009, 0.022, 0.0, 0.0, 0.0]
cable: {youngs_modulus: 1.0e9, diameter: 0.003, linear_density: 0.01, retardation_time: 1.0e-3}
pulley: {radius: 0.02}
winch: {drum_radius: 0.05, gear_ratio: 20.0, motor_speed_rpm: 1500.0, motor_torque: 2.0}
tension_bounds: {lower: 1.0, upper: 100.0}
frame: {lower: [-1.0, -1.0, 0.0], upper: [1.0, 1.0, 2.0], beam: 0.05}
home: {position: [0.0, 0.0, 0.5], angles_deg: [0.0, 0.0, 0.0]}
cables:
  - {name: left, exit_point: [-1.0, 0.0, 2.0], anchor_point: [-0.1, 0.0, 0.1]}
  - {name: right, exit_point: [1.0, 0.0, 2.0], anchor_point: [0.1, 0.0, 0.1]}
  - {name: back, exit_point: [0.0, 1.0, 2.0], anchor_point: [0.0, 0.15, 0.1]}
cameras:
  - name: eye
    model: astra
    pose: {position: [0.0, 0.0, -0.05], angles_deg: [180.0, 0.0, 0.0]}
"""


def write(folder, content):
    """The path of a robot file with this content, text or a mapping."""
    path = folder / "robot.yaml"
    text = content if isinstance(content, str) else yaml.safe_dump(content, sort_keys=False)
    path.write_text(text, encoding="utf-8")
    return path


def changed(*keys, to):
    """The mapping of `ROBOT` with one value changed."""
    content = yaml.safe_load(ROBOT)
    node = content
    for key in keys[:-1]:
        node = node[key]
    node[keys[-1]] = to
    return content


def refusal(path):
    """The message of the RobotFileError that loading raises; it is one line and names the file."""
    with pytest.raises(RobotFileError) as caught:
        load_robot(str(path))
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    return message.removeprefix(str(path))


def test_a_good_file_loads_by_path(tmp_path):
    robot = load_robot(str(write(tmp_path, ROBOT)))
    assert robot.name == "crate"
    assert [cable.name for cable in robot.cables] == ["left", "right", "back"]
    np.testing.assert_array_equal(robot.exit_points()[:, 1], [1.0, 0.0, 2.0])
    np.testing.assert_array_equal(robot.anchor_points()[:, 2], [0.0, 0.15, 0.1])
    np.testing.assert_array_equal(robot.center_of_mass(), [0.0, 0.0, 0.04])
    assert robot.gravity == 9.81
    assert not robot.is_planar()
    assert robot.camera_mount("eye").parent == "platform"


def test_what_a_file_leaves_out_gets_its_default(tmp_path):
    content = yaml.safe_load(ROBOT)
    for key in ("center_of_mass", "inertia"):
        del content["platform"][key]
    del content["winch"]["motor_torque"], content["home"]["angles_deg"], content["cameras"]
    robot = load_robot(str(write(tmp_path, content)))
    assert robot.platform.inertia is None
    assert robot.winch.motor_torque is None
    assert robot.cameras == []
    # The middle of the box whose bottom face holds Po.
    np.testing.assert_allclose(robot.center_of_mass(), [0.0, 0.0, 0.05])
    np.testing.assert_array_equal(robot.home.angles_deg, np.zeros(3))


def test_two_robots_do_not_share_arrays():
    one, other = load_robot("planar"), load_robot("planar")
    one.home.angles_deg[2] = 90.0
    one.platform.size[0] = 9.0
    assert other.home.angles_deg[2] == 0.0
    assert other.platform.size[0] != 9.0


def test_unknown_robot_says_which_exist():
    with pytest.raises(RobotFileError) as caught:
        load_robot("acrobot_smal")
    message = str(caught.value)
    assert "acrobot_smal" in message
    assert "did you mean acrobot_small?" in message
    assert all(name in message for name in robot_names())
    assert "\n" not in message


def test_unknown_camera_says_which_exist():
    with pytest.raises(RobotFileError, match=r"camera 'webcam' is unknown; .*astra.*mt4018"):
        load_camera("webcam")


def test_missing_file_is_named(tmp_path):
    with pytest.raises(RobotFileError, match="there is no such robot file"):
        robot_file(str(tmp_path / "absent.yaml"))


def test_a_folder_is_not_a_robot_file(tmp_path):
    folder = tmp_path / "folder.yaml"
    folder.mkdir()
    with pytest.raises(RobotFileError, match="there is no such robot file"):
        load_robot(str(folder))


def test_a_file_that_is_not_yaml_is_refused_with_its_line(tmp_path):
    lines = ROBOT.splitlines()
    lines[3] = "  mass: [2.0"
    message = refusal(write(tmp_path, "\n".join(lines)))
    # The parser notices on the line after the one that is broken.
    assert re.match(r":5: does not parse as YAML: ", message)


def test_an_empty_file_is_refused(tmp_path):
    assert "found no mapping" in refusal(write(tmp_path, ""))


def test_a_file_that_is_not_text_is_refused(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_bytes(b"\xff\xfe\x00name")
    assert "cannot be read" in refusal(path)


def test_unknown_key_is_refused_with_its_line_and_the_likely_one(tmp_path):
    message = refusal(write(tmp_path, ROBOT.replace("  mass: 2.0", "  mas: 2.0")))
    assert message.startswith(":4: platform.mas: unknown key; did you mean mass?")


def test_missing_key_is_refused_with_what_is_accepted(tmp_path):
    message = refusal(write(tmp_path, ROBOT.replace("  mass: 2.0\n", "")))
    assert message.startswith(":4: platform.mass: missing; accepted: a number > 0 [kg]")


def test_key_given_twice_is_refused(tmp_path):
    message = refusal(write(tmp_path, ROBOT.replace("  mass: 2.0", "  mass: 2.0\n  mass: 3.0")))
    assert message.startswith(":5: platform.mass: found twice")


NUMBER_CASES = [
    (("platform", "mass"), "nan", "a number > 0 [kg]"),
    (("platform", "mass"), math.nan, "a number > 0 [kg]"),
    (("platform", "mass"), -1.0, "a number > 0 [kg]"),
    (("platform", "mass"), 0.0, "a number > 0 [kg]"),
    (("platform", "mass"), math.inf, "a number > 0 [kg]"),
    (("platform", "mass"), "heavy", "a number > 0 [kg]"),
    (("platform", "mass"), None, "a number > 0 [kg]"),
    (("platform", "size"), [0.1, 0.2], "3 numbers > 0 [m]"),
    (("platform", "size"), 0.1, "3 numbers > 0 [m]"),
    (("platform", "inertia"), [1.0, 1.0, 1.0], "6 numbers [kg m^2] or null"),
    (("cable", "diameter"), math.nan, "a number > 0 [m]"),
    (("cable", "diameter"), -0.002, "a number > 0 [m]"),
    (("cable", "youngs_modulus"), math.nan, "a number > 0 [Pa]"),
    (("cable", "youngs_modulus"), 0.0, "a number > 0 [Pa]"),
    (("cable", "retardation_time"), -1e-4, "a number >= 0 and <= 1 [s]"),
    (("cable", "retardation_time"), 90.0, "a number >= 0 and <= 1 [s]"),
    (("winch", "gear_ratio"), 0.0, "a number > 0 [-]"),
    (("tension_bounds", "lower"), -1.0, "a number >= 0 [N]"),
    (("gravity",), -9.81, "a number >= 0 [m/s^2]"),
    (("motion",), "4T", "one of 1T, 2T, 3T, 2T1R, 1R2T, 2R3T, 3R3T"),
    (("cables", 1, "exit_point"), [1.0, 0.0], "3 numbers [m]"),
    (("cables",), {"name": "left"}, "a list of mappings"),
    (("cameras", 0, "parent"), "ceiling", "one of platform, world"),
]


@pytest.mark.parametrize(("keys", "value", "accepted"), NUMBER_CASES)
def test_a_value_out_of_range_is_refused(tmp_path, keys, value, accepted):
    message = refusal(write(tmp_path, changed(*keys, to=value)))
    field = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)[1:]
    assert re.match(rf":\d+: {re.escape(field)}: found ", message)
    assert message.endswith(f"accepted: {accepted}")


def test_one_bad_number_in_an_array_is_named(tmp_path):
    message = refusal(write(tmp_path, ROBOT.replace("[0.2, 0.3, 0.1]", "[0.2, .nan, 0.1]")))
    assert message == ":5: platform.size[1]: found .nan; accepted: 3 numbers > 0 [m]"


def _points_meet_at_home():
    content = changed("home", "position", to=[0.0, 0.0, 1.0])
    content["cables"][1]["anchor_point"] = [1.0, 0.0, 1.0]
    return content


def _two_mounts_of_one_name():
    content = yaml.safe_load(ROBOT)
    content["cameras"].append(copy.deepcopy(content["cameras"][0]))
    return content


IMPOSSIBLE = {
    "bounds crossed": (
        changed("tension_bounds", "lower", to=200.0),
        "tension_bounds: found lower 200, upper 100",
        "lower < upper",
    ),
    "bounds equal": (
        changed("tension_bounds", "lower", to=100.0),
        "tension_bounds: found lower 100, upper 100",
        "lower < upper",
    ),
    "frame crossed": (
        changed("frame", "upper", to=[1.0, -1.0, 2.0]),
        "frame: found lower ",
        "lower < upper",
    ),
    "planar without height": (
        changed("motion", to="2T1R"),
        "plane_height: found ",
        "a height for robots in a horizontal plane, null for others",
    ),
    "height without planar": (
        changed("plane_height", to=0.5),
        "plane_height: found 0.5",
        "a height for robots in a horizontal plane, null for others",
    ),
    "no cables": (changed("cables", to=[]), "cables: found none", "at least one cable"),
    "inertia breaks the triangle inequality": (
        changed("platform", "inertia", to=[0.01, 0.01, 0.03, 0.0, 0.0, 0.0]),
        "platform.inertia: found ",
        "positive principal moments, none larger than the sum of the other two",
    ),
    "inertia is not positive": (
        changed("platform", "inertia", to=[0.01, 0.01, 0.01, 0.02, 0.0, 0.0]),
        "platform.inertia: found ",
        "positive principal moments, none larger than the sum of the other two",
    ),
    "a cable's name twice": (
        changed("cables", 2, "name", to="left"),
        "cables[2].name: found left twice",
        "each name once",
    ),
    "exit point on anchor point at home": (
        _points_meet_at_home(),
        "cables[1] (right): found exit point ",
        "points at least 0.001 m apart there",
    ),
    "unknown camera": (
        changed("cameras", 0, "model", to="webcam"),
        "cameras[0].model: found webcam",
        "one of astra, ids_kowa, mt4018, or the path of a camera file",
    ),
    "a mounting's name twice": (
        _two_mounts_of_one_name(),
        "cameras[1].name: found eye twice",
        "each name once",
    ),
}


@pytest.mark.parametrize("case", IMPOSSIBLE)
def test_an_impossible_robot_is_refused(tmp_path, case):
    content, found, accepted = IMPOSSIBLE[case]
    message = refusal(write(tmp_path, content))
    assert message.startswith(f": {found}")
    assert message.endswith(f"; accepted: {accepted}")


@pytest.mark.parametrize("point", [[-1.0, 0.0, 2.0], [0.0, 0.0, 0.0]])
def test_the_same_numbers_in_two_frames_are_not_one_point(tmp_path, point):
    """An exit point is in W, an anchor point in P; at home they are half a metre apart."""
    content = changed("cables", 0, "anchor_point", to=point)
    content["cables"][0]["exit_point"] = list(point)
    robot = load_robot(str(write(tmp_path, content)))
    np.testing.assert_array_equal(robot.exit_points()[:, 0], robot.anchor_points()[:, 0])


def test_the_inertia_of_a_thin_plate_is_accepted(tmp_path):
    """One moment equal to the sum of the other two is the limit of the possible."""
    plate = [0.01, 0.02, 0.03, 0.0, 0.0, 0.0]
    robot = load_robot(str(write(tmp_path, changed("platform", "inertia", to=plate))))
    np.testing.assert_array_equal(robot.platform.inertia, plate)


def number_keys(node, keys=()):
    """Key paths of all numbers in a mapping."""
    if isinstance(node, dict):
        items = list(node.items())
    elif isinstance(node, list):
        items = list(enumerate(node))
    else:
        return [keys] if isinstance(node, float) else []
    return [path for key, child in items for path in number_keys(child, (*keys, key))]


def numbers(value):
    """All numbers in a loaded robot."""
    if hasattr(value, "__dataclass_fields__"):
        value = list(vars(value).values())
    if isinstance(value, list):
        return [number for child in value for number in numbers(child)]
    return [] if value is None or isinstance(value, str) else np.ravel(value).tolist()


@given(
    keys=st.sampled_from(number_keys(yaml.safe_load(ROBOT))),
    value=st.one_of(
        st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -1.0]), st.floats(-1e3, 1e3)
    ),
)
def test_no_number_makes_a_robot_that_is_not_one(tmp_path_factory, keys, value):
    path = write(tmp_path_factory.mktemp("mutated"), changed(*keys, to=value))
    try:
        robot = load_robot(str(path))
    except RobotFileError:
        return
    assert np.all(np.isfinite(numbers(robot)))
    assert robot.platform.mass > 0.0
    assert np.all(robot.platform.size > 0.0)
    assert np.all(robot.stiffness() > 0.0)
    assert robot.winch.rated_cable_speed() > 0.0
    assert 0.0 <= robot.tension_bounds.lower < robot.tension_bounds.upper
    assert np.all(robot.frame.lower < robot.frame.upper)
    assert platform_inertia(robot).IsPhysicallyValid()


def test_an_array_in_a_message_stays_on_one_line(tmp_path):
    path = write(tmp_path, changed("platform", "inertia", 0, to=1000001.0))
    assert "\n" not in refusal(path)


def test_cables_may_be_named_by_numbers(tmp_path):
    assert (
        load_robot(str(write(tmp_path, changed("cables", 0, "name", to=1)))).cables[0].name == "1"
    )


def test_all_problems_of_a_robot_are_said_at_once(tmp_path):
    content = yaml.safe_load(ROBOT)
    content["tension_bounds"] = {"lower": 5.0, "upper": 4.0}
    content["cables"][1]["name"] = "left"
    content["cameras"][0]["model"] = "box"
    with pytest.raises(RobotFileError) as caught:
        load_robot(str(write(tmp_path, content)))
    fields = [problem.split(": ")[1] for problem in caught.value.problems]
    assert fields == ["tension_bounds", "cables[1].name", "cameras[0].model"]


def test_what_is_only_drawn_or_shown_may_be_left_out(tmp_path):
    content = yaml.safe_load(ROBOT)
    del content["title"], content["frame"]["beam"]
    robot = load_robot(str(write(tmp_path, content)))
    assert robot.title == ""
    assert robot.frame.beam_width() == 2.0 / 30.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"cable_model": "inextensible"},
            "cable_model: found inextensible; accepted: one of",
        ),
        ({"damping": {"translation": -1.0}}, "damping.translation: found -1.0; accepted: a number"),
        (
            {"cable_model": "catenary", "pulley": {"radius": 0.01, "swivel_axis": [1, 0, 1]}},
            "cable_model: swivel_axis of cable 1",
        ),
        (
            {"cable_model": "catenary", "gravity_direction": [1, 0, 0]},
            "cable_model: .*gravity",
        ),
    ],
)
def test_a_model_that_cannot_be_is_refused_by_its_key(tmp_path, change, words):
    path = write(tmp_path, {**yaml.safe_load(ROBOT), **change})
    with pytest.raises(RobotFileError, match=rf"robot.yaml[:0-9]*: {words}"):
        load_robot(path)


@pytest.mark.parametrize(
    "name",
    [
        "a,b",
        "a\nb",
        "=1+1",
        "+C1",
        "@C1",
        "a;b",
        'a"b',
        "a\tb",
        "\x1b[31m",
        "",
        " C1",
        "C" * 65,
        ".C",
    ],
)
def test_names_of_cables_are_checked_as_those_of_robots(name, tmp_path):
    """They are columns of logs, which other programs read."""
    for key in (("name",), ("cables", 1, "name")):
        with pytest.raises(RobotFileError) as caught:
            load_robot(write(tmp_path, changed(*key, to=name)))
        assert "accepted: 1 to 64 letters, digits, _ . -" in str(caught.value)
        assert "\n" not in str(caught.value)
    assert load_robot(write(tmp_path, changed("cables", 1, "name", to="C-1_a.b"))).cables[1].name


def test_points_outside_frame_and_platform_are_remarked(tmp_path):
    content = yaml.safe_load(ROBOT)
    assert point_notes(load_robot(write(tmp_path, content))) == []
    content["cables"][0]["exit_point"] = [-1.25, 0.0, 2.0]
    content["cables"][2]["anchor_point"] = [0.0, 0.19, 0.1]
    outside, off = point_notes(load_robot(write(tmp_path, content)))
    assert outside == (
        "exit points of left: up to 0.25 m outside the frame, (-1, -1, 0) to (1, 1, 2) m"
    )
    assert off.startswith("anchor points of back: up to 0.04 m outside the platform's box, (-0.1,")
    assert checked(tmp_path / "robot.yaml")["notes"][:2] == [outside, off]
    content["frame"]["assumed"] = True
    assert point_notes(load_robot(write(tmp_path, content))) == [off]
