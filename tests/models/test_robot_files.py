"""Robot files: what they give, and one line on each that is no possible robot."""

import copy
import math
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from cdpr_drake.analyses.checks import check_files
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import (
    load_robot,
    parse_robot,
    point_notes,
    robot_file,
    robot_names,
)
from cdpr_drake.models.winch_schema import Friction, Winch
from cdpr_drake.winches.drum import Drum
from cdpr_drake.winches.friction import FrictionLaw
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

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


def changed(**changes):
    """The mapping of `ROBOT` with other values; `cables__1__name` is the name of the second."""
    content = yaml.safe_load(ROBOT)
    for key, value in changes.items():
        *way, last = (int(part) if part.isdigit() else part for part in key.split("__"))
        node = content
        for part in way:
            node = node[part]
        node[last] = value
    return content


def robot(**changes):
    return parse_robot(yaml.safe_dump(changed(**changes), sort_keys=False), Path("robot.yaml"))


def refusal(text):
    """The message of the RobotFileError of a text, without the file's name; it is one line."""
    with pytest.raises(RobotFileError) as caught:
        parse_robot(text, Path("robot.yaml"))
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("robot.yaml")
    return message.removeprefix("robot.yaml")


OVER_0, MASS = "a number > 0", "platform__mass"
MOMENTS = "positive principal moments, none larger than the sum of the other two"
HEIGHT = "a height for robots in a horizontal plane, null for others"
FRICTION = {"coulomb": 0.01, "static": 0.02, "stribeck_speed": 3.0}
EYE = yaml.safe_load(ROBOT)["cameras"][0]
RAIL = {"axis": [0.0, 0.0, 2.0], "lower": -0.2, "upper": 0.1}

# (changes, the key that is named with what was found there, what is accepted)
REFUSALS = [
    ({MASS: 0.0}, "platform.mass: found ", f"{OVER_0} and <= 1e+07 [kg]"),
    ({"platform__size": [0.1, 0.2]}, "platform.size: found ", "3 numbers > 0 and <= 10000 [m]"),
    ({"platform__inertia": [1.0, 1, 1]}, "platform.inertia: found ", "6 numbers [kg m^2] or null"),
    ({"platform__inertia": [0.01, 0.01, 0.03, 0, 0, 0]}, "platform.inertia: found ", MOMENTS),
    ({"platform__inertia": [0.01, 0.01, 0.01, 0.02, 0, 0]}, "platform.inertia: found ", MOMENTS),
    ({"platform__inertia__0": 1000001.0}, "platform.inertia: found ", MOMENTS),
    ({"cable__diameter": -0.002}, "cable.diameter: found ", f"{OVER_0} and <= 1 [m]"),
    ({"cable__youngs_modulus": 0.0}, "cable.youngs_modulus: found ", f"{OVER_0} and <= 1e+13 [Pa]"),
    ({"cable__retardation_time": -1e-4}, "cable.retardation_time: found ",
     "a number >= 0 and <= 1 [s]"),
    ({"cable__retardation_time": 90.0}, "cable.retardation_time: found ",
     "a number >= 0 and <= 1 [s]"),
    ({"winch__gear_ratio": 0.0}, "winch.gear_ratio: found ", f"{OVER_0} [-]"),
    ({"tension_bounds__lower": -1.0}, "tension_bounds.lower: found ", "a number >= 0 [N]"),
    ({"tension_bounds__lower": 100.0}, "tension_bounds: found lower 100, upper 100",
     "lower < upper"),
    ({"gravity": -9.81}, "gravity: found ", "a number >= 0 and <= 1000 [m/s^2]"),
    ({"motion": "4T"}, "motion: found ", "one of 1T, 2T, 3T, 2T1R, 1R2T, 2R3T, 3R3T"),
    ({"motion": "2T1R"}, "plane_height: found ", HEIGHT),
    ({"plane_height": 0.5}, "plane_height: found 0.5", HEIGHT),
    ({"frame__upper": [1.0, -1.0, 2.0]}, "frame: found lower ", "lower < upper"),
    ({"cables": {"name": "left"}}, "cables: found ", "a list of mappings"),
    ({"cables": []}, "cables: found none", "at least one cable"),
    ({"cables__1__exit_point": [1.0, 0.0]}, "cables[1].exit_point: found ",
     "3 numbers >= -10000 and <= 10000 [m]"),
    ({"cables__2__name": "left"}, "cables[2].name: found left twice", "each name once"),
    ({"home__position": [0.0, 0.0, 1.0], "cables__1__anchor_point": [1.0, 0.0, 1.0]},
     "cables[1]: found exit point ", "points at least 0.001 m apart there"),
    ({"cameras__0__parent": "ceiling"}, "cameras[0].parent: found ", "one of platform, world"),
    ({"cameras__0__model": "webcam"}, "cameras[0].model: found webcam",
     "one of astra, ids_kowa, mt4018, or the path of a camera file"),
    ({"cameras": [EYE, copy.deepcopy(EYE)]}, "cameras[1].name: found eye twice", "each name once"),
    ({"cable_model": "inextensible"}, "cable_model: found inextensible", "one of ..."),
    ({"damping": {"translation": -1.0}}, "damping.translation: found -1.0", "a number ..."),
    ({"cable_model": "catenary", "pulley__swivel_axis": [1, 0, 1]},
     "cable_model: swivel_axis of cable 1", "..."),
    ({"cable_model": "catenary", "gravity_direction": [1, 0, 0]}, "cable_model: ...gravity", "..."),
    ({"winch__friction": FRICTION | {"coulomb": -0.01}}, "winch.friction.coulomb: found -0.01",
     "a number >= 0 [N m]"),
    ({"winch__friction": FRICTION | {"coulomb": 0.03}}, "winch.friction.static: found 0.02",
     "at least coulomb = 0.03 [N m]"),
    ({"winch__friction": FRICTION | {"stribeck_speed": 0.0}},
     "winch.friction.stribeck_speed: found 0.0", f"{OVER_0} [rad/s]"),
    ({"winch__inertia": 0.0}, "winch.inertia: found 0.0", f"{OVER_0} [kg m^2]..."),
    ({"winch__brake_torque": -1.0}, "winch.brake_torque: found -1.0", f"{OVER_0}..."),
    ({"winch__layers": {"turns": 0.5, "wound": 1.0}}, "winch.layers.turns: found 0.5",
     "a number >= 1..."),
    ({"cables__2__material": {"diameter": 3.0}}, "cables[2].material.diameter: found 3", "..."),
    ({"cables__2__material": {"youngs_modulus": -1.0}},
     "cables[2].material.youngs_modulus: found -1", "..."),
    ({"cables__1__anchor_swivel_axis": [0.0, 0.0, 0.0]},
     "cables[1].anchor_swivel_axis: found [0.0, 0.0, 0.0]", "3 numbers, not all zero..."),
    ({"cables__0__rail": RAIL | {"axis": [0, 0, 0]}}, "cables[0].rail.axis: found [0, 0, 0]",
     "3 numbers, not all zero..."),
    ({"cables__0__rail": RAIL | {"lower": 0.2}}, "cables[0].rail: found lower 0.2, upper 0.1",
     "lower < upper..."),
    ({"cables__0__rail": RAIL | {"at": 0.2}}, "cables[0].rail.at: found 0.2", "-0.2 to 0.1..."),
    ({"platform__shape": {"kind": "sphere"}}, "platform.shape.radius: found null",
     "a value, for..."),
    ({"platform__shape": {"kind": "cylinder", "radius": 0.1}},
     "platform.shape.height: found null", "..."),
    ({"platform__shape": {"kind": "sphere", "radius": 0.4}},
     "platform.shape: found reaching from (-0.4", "..."),
    ({"platform__shape": {"kind": "mesh", "file": "no.obj"}},
     "platform.shape.file: found no.obj", "..."),
    ({"platform__inertia_of": "shape", "platform__inertia": None},
     "platform.inertia_of: found shape", "box, or a section..."),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "found", "accepted"), REFUSALS)
def test_an_impossible_robot_is_refused_by_its_key(changes, found, accepted):
    message = refusal(yaml.safe_dump(changed(**changes), sort_keys=False))
    pattern = f"{found}...; accepted: {accepted}" if accepted != "..." else f"{found}..."
    pattern = re.escape(pattern).replace(r"\.\.\.", ".*")
    assert re.fullmatch(rf"(:\d+)?: {pattern}", message)


def test_an_unknown_key_is_refused_with_its_line():
    words = ":4: platform.mas: unknown key; did you mean mass?"
    assert words in refusal(ROBOT.replace("  mass: 2.0", "  mas: 2.0"))


def test_all_problems_of_a_robot_are_said_at_once():
    with pytest.raises(RobotFileError) as caught:
        robot(tension_bounds={"lower": 5.0, "upper": 4.0}, cables__1__name="left",
              cameras__0__model="box")  # fmt: skip
    fields = [problem.split(": ")[1] for problem in caught.value.problems]
    assert fields == ["tension_bounds", "cables[1].name", "cameras[0].model"]


@pytest.mark.parametrize(
    "name", ["a,b", "a\nb", "=1+1", "+C1", "@C1", "a;b", 'a"b', "a\tb", "\x1b[31m", "", " C1",
             "C" * 65, ".C"],
)  # fmt: skip
@pytest.mark.parametrize("key", ["name", "cables__1__name"])
def test_names_of_cables_are_checked_as_those_of_robots(key, name):
    """They are columns of logs, which other programs read."""
    message = refusal(yaml.safe_dump(changed(**{key: name}), sort_keys=False))
    assert "accepted: 1 to 64 letters, digits, _ . -" in message


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda there: load_camera("webcam"), r"camera 'webcam' is unknown; .*astra.*mt4018"),
        (lambda there: robot_file(str(there / "absent.yaml")), "there is no such robot file"),
        (lambda there: load_robot(str(there / "folder.yaml")), "there is no such robot file"),
        (lambda there: load_robot(str(there / "bytes.yaml")), "bytes.yaml.*cannot be read"),
        (lambda there: load_robot("acrobot_smal"),
         "acrobot_smal.*" + ".*".join(sorted(robot_names())) + ".*did you mean acrobot_small?"),
    ],
)  # fmt: skip
def test_files_and_names_that_are_none(call, words, tmp_path):
    (tmp_path / "folder.yaml").mkdir()
    (tmp_path / "bytes.yaml").write_bytes(b"\xff\xfe\x00name")
    with pytest.raises(RobotFileError) as caught:
        call(tmp_path)
    message = str(caught.value)
    assert "\n" not in message
    for part in words.split(".*"):
        assert part in message


def test_a_good_file_loads_by_path(tmp_path):
    path = tmp_path / "crate.yaml"
    path.write_text(ROBOT)
    crate = load_robot(str(path))
    assert crate.name == "crate"
    assert [cable.name for cable in crate.cables] == ["left", "right", "back"]
    np.testing.assert_array_equal(crate.exit_points()[:, 1], [1.0, 0.0, 2.0])
    np.testing.assert_array_equal(crate.anchor_points()[:, 2], [0.0, 0.15, 0.1])
    np.testing.assert_array_equal(crate.center_of_mass(), [0.0, 0.0, 0.04])
    assert crate.gravity == 9.81
    assert not crate.is_planar()
    assert crate.camera_mount("eye").parent == "platform"


def test_what_a_file_leaves_out_gets_its_default():
    content = yaml.safe_load(ROBOT)
    del content["platform"]["center_of_mass"], content["platform"]["inertia"]
    del content["winch"]["motor_torque"], content["home"]["angles_deg"], content["frame"]["beam"]
    del content["cameras"], content["title"]
    bare = parse_robot(yaml.safe_dump(content), Path("robot.yaml"))
    assert (bare.platform.inertia, bare.winch.motor_torque) == (None, None)
    assert (bare.cameras, bare.title) == ([], "")
    # The middle of the box whose bottom face holds Po.
    np.testing.assert_allclose(bare.center_of_mass(), [0.0, 0.0, 0.05])
    np.testing.assert_array_equal(bare.home.angles_deg, np.zeros(3))
    assert bare.frame.beam_width() == 2.0 / 30.0


@pytest.mark.parametrize("point", [[-1.0, 0.0, 2.0], [0.0, 0.0, 0.0]])
def test_the_same_numbers_in_two_frames_are_not_one_point(point):
    """An exit point is in W, an anchor point in P; at home they are half a metre apart."""
    crate = robot(cables__0__exit_point=point, cables__0__anchor_point=point)
    np.testing.assert_array_equal(crate.exit_points()[:, 0], crate.anchor_points()[:, 0])


def test_limits_of_what_is_possible_are_possible():
    """One moment equal to the sum of the others: a thin plate; a number as a name; - . and _."""
    plate = [0.01, 0.02, 0.03, 0.0, 0.0, 0.0]
    crate = robot(platform__inertia=plate, cables__0__name=1, cables__1__name="C-1_a.b")
    np.testing.assert_array_equal(crate.platform.inertia, plate)
    assert [cable.name for cable in crate.cables[:2]] == ["1", "C-1_a.b"]


def number_keys(node, keys=()):
    """Key paths of all numbers in a mapping."""
    if not isinstance(node, dict | list):
        return ["__".join(map(str, keys))] if isinstance(node, float) else []
    items = node.items() if isinstance(node, dict) else enumerate(node)
    return [path for key, child in items for path in number_keys(child, (*keys, key))]


def numbers(value):
    """All numbers in a loaded robot."""
    if hasattr(value, "__dataclass_fields__"):
        value = list(vars(value).values())
    if isinstance(value, list):
        return [number for child in value for number in numbers(child)]
    return [] if value is None or isinstance(value, str) else np.ravel(value).tolist()


@settings(max_examples=40)
@given(
    st.sampled_from(number_keys(yaml.safe_load(ROBOT))),
    st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -1.0]) | st.floats(-1e3, 1e3),
)
def test_no_number_makes_a_robot_that_is_not_one(key, value):
    try:
        crate = robot(**{key: value})
    except RobotFileError:
        return
    assert np.all(np.isfinite(numbers(crate)))
    assert crate.platform.mass > 0.0
    assert np.all(crate.platform.size > 0.0)
    assert np.all(crate.stiffness() > 0.0)
    assert crate.winch.rated_cable_speed() > 0.0
    assert 0.0 <= crate.tension_bounds.lower < crate.tension_bounds.upper
    assert np.all(crate.frame.lower < crate.frame.upper)
    assert platform_inertia(crate).IsPhysicallyValid()


def test_points_outside_frame_and_platform_are_remarked(tmp_path):
    assert point_notes(robot()) == []
    off = {"cables__0__exit_point": [-1.25, 0.0, 2.0], "cables__2__anchor_point": [0.0, 0.19, 0.1]}
    outside, beyond = point_notes(robot(**off))
    assert outside == (
        "exit points of left: up to 0.25 m outside the frame, (-1, -1, 0) to (1, 1, 2) m"
    )
    words = "anchor points of back: up to 0.04 m outside the platform's box, (-0.1,"
    assert beyond.startswith(words)
    path = tmp_path / "robot.yaml"
    path.write_text(yaml.safe_dump(changed(**off), sort_keys=False))
    assert check_files([path]).entries[0]["notes"][:2] == [outside, beyond]
    assert point_notes(robot(**off, frame__assumed=True)) == [beyond]


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_every_robot_that_comes_with_the_package_has_motors(name):
    shipped = load_robot(name)
    law = shipped.winch_law()
    assert law.drum.radius == shipped.winch.drum_radius + shipped.cable.diameter / 2.0
    assert law.rated_speed == pytest.approx(shipped.winch.motor_speed_rpm * np.pi / 30.0)
    assert 0.0 < law.friction.coulomb <= law.friction.static


def test_a_winch_with_every_section_becomes_a_law():
    winch = {"drum_radius": 0.04, "gear_ratio": 10.0, "motor_speed_rpm": 3000.0,
             "motor_torque": 0.5, "inertia": 2e-5, "friction": FRICTION | {"viscous": 1e-4},
             "layers": {"turns": 10.0, "wound": 1.5}, "brake_torque": 1.0,
             "loops": {"velocity_bandwidth": 300.0, "position_bandwidth": 40.0}}  # fmt: skip
    law = robot(winch=winch, cable__diameter=0.002).winch_law()
    assert law.drum == Drum(0.041, 10.0, 10.0, 0.002, 1.5)
    assert law.friction == FrictionLaw(0.01, 0.02, 1e-4, 3.0, 1e-3)
    assert (law.inertia, law.rated_torque, law.brake_torque) == (2e-5, 0.5, 1.0)
    assert (law.velocity_bandwidth, law.position_bandwidth) == (300.0, 40.0)


def test_what_a_winch_leaves_out_does_not_limit():
    winch = Winch(drum_radius=0.04, gear_ratio=10.0, motor_speed_rpm=3000.0)
    assert winch.law(0.002) is None
    winch.inertia = 1e-5
    law = winch.law(0.002)
    assert law.rated_torque == np.inf
    assert law.friction == FrictionLaw()
    assert not law.drum.has_layers()
    assert law.brake_torque == 0.0
    assert (law.velocity_bandwidth, law.position_bandwidth) == (200.0, 20.0)
    winch.friction = Friction(**FRICTION)
    assert winch.law(0.002).friction == FrictionLaw(0.01, 0.02, 0.0, 3.0, 1e-3)
