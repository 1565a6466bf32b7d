"""Files of mechanisms: what they give, and what is said of those that are wrong."""

from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.mechanism_files import is_mechanism, mechanism_names
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.models.mechanism_loader import (
    load_mechanism,
    load_robot_or_mechanism,
    parse_mechanism,
)
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_loader import robot_file, robot_names
from cdpr_drake.models.robot_schema import Robot
from tests.models.mechanisms.small_mechanisms import ARM, DIRECTIVES, MECHANISM, link, write_small

pytestmark = pytest.mark.usefixtures("in_this_process")

EXACT = 1e-15
"""Rounding of one rotation by 90 deg and one sum [m]."""


def added(mechanism: Mechanism, name="") -> tuple[MultibodyPlant, object]:
    plant = MultibodyPlant(0.0)
    return plant, add_mechanism(plant, mechanism, name)


def test_bodies_home_and_routes_are_those_of_the_file(tmp_path):
    plant, put = added(load_mechanism(write_small(tmp_path)))
    put.finalize()
    np.testing.assert_array_equal(put.home_positions(), [1, 0, 0, 0, 0, 0, 0.5, 0.2])
    np.testing.assert_array_equal(plant.gravity_field().gravity_vector(), [0, 0, -9.81])
    routes = put.routes()
    bodies = [plant.GetBodyByName(name).index() for name in ("platform", "lower")]
    platform, lower = map(int, bodies)
    assert routes.names == ("C1", "E")
    assert routes.bodies.tolist() == [0, platform, platform, lower, lower]
    assert routes.first.tolist() == [0, 2, 5]
    # z of the block's frame is x of W.
    np.testing.assert_allclose(routes.p_BQ[:, 0], [1.5, 0, 0], atol=EXACT)
    np.testing.assert_allclose(routes.ends.linear_weight, 0.003 * 9.81)


def test_two_of_one_kind_in_one_plant(tmp_path):
    # Frames of the world, as block, bear no prefix.
    text, directives = MECHANISM.replace("block", "world"), DIRECTIVES.split("- add_frame")[0]
    mechanism = load_mechanism(write_small(tmp_path, text, directives=directives))
    plant = MultibodyPlant(0.0)
    both = [add_mechanism(plant, mechanism, name) for name in ("left", "right")]
    plant.Finalize()
    left, right = (one.routes() for one in both)
    assert set(left.touched_bodies()).isdisjoint(right.touched_bodies())
    assert plant.HasModelInstanceNamed("left::arm")


def test_urdf_sdf_and_mjcf_are_read(tmp_path):
    inertia = "<ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz>"
    sdf = f"""<sdf version="1.9"><model name="arm"><link name="platform"><inertial><mass>1</mass>
<inertia>{inertia}</inertia></inertial></link><frame name="tip"><pose>0 0 0.1 0 0 0</pose></frame>
</model></sdf>"""
    mjcf = """<mujoco model="arm"><worldbody><body name="platform"><freejoint/>
<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/></body></worldbody></mujoco>"""
    text = (
        MECHANISM.split("  - {name: E")[0]
        .replace("joints: {arm::elbow: 0.2}, ", "")
        .replace(", exit_frame: block", "")
    )
    for name, content in (("a.sdf", sdf), ("a.xml", mjcf), ("a.urdf", ARM)):
        (tmp_path / name).write_text(content, encoding="utf-8")
        path = write_small(tmp_path, text.replace("arm.dmd.yaml", name).replace("arm::pl", "pl"))
        _, put = added(load_mechanism(path))
        put.finalize()
        assert put.home_positions()[6] == 0.5
        assert put.routes().count == 1


def test_packages_near_the_file_go_before_those_of_ros(tmp_path, monkeypatch):
    for folder, name in (("here/parts", "parts"), ("ros/parts", "parts"), ("ros/more", "more")):
        where = tmp_path / folder
        where.mkdir(parents=True)
        (where / "package.xml").write_text(f"<package><name>{name}</name></package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    found = load_mechanism(write_small(tmp_path / "here")).packages
    paths = {name: Path(path) for name, path in found.items()}
    assert paths == {"parts": tmp_path / "here/parts", "more": tmp_path / "ros/more"}


def test_packages_near_the_file_and_given_ones(tmp_path):
    package, elsewhere = tmp_path / "parts", tmp_path / "elsewhere"
    for folder in (package / "urdf", elsewhere):
        folder.mkdir(parents=True)
        (folder / "arm.urdf").write_text(ARM, encoding="utf-8")
    (package / "package.xml").write_text("<package><name>my_parts</name></package>")
    directives = DIRECTIVES.replace("arm.urdf", "package://my_parts/urdf/arm.urdf")
    path = write_small(tmp_path, directives=directives)
    (tmp_path / "arm.urdf").unlink()
    assert load_mechanism(path).packages["my_parts"].rstrip("/") == str(package)
    text = MECHANISM.replace(
        "arm.dmd.yaml", "package://other/arm.urdf\npackages: {other: elsewhere}"
    )
    text = text.replace(", exit_frame: block", "")
    mechanism = load_mechanism(write_small(tmp_path, text))
    assert mechanism.mechanism == str(elsewhere / "arm.urdf")


WRONG = [
    ("anchor_frame: platform", "anchor_frame: plat",
     "cables[0].anchor_frame: found plat; accepted: one of world, arm::elbow_parent, arm::lower, "
     "arm::platform, block"),
    ("frame: arm::lower, p", "frame: arm::low, p", "cables[1].via[0].frame: found arm::low"),
    ("arm::elbow: 0.2", "arm::elbo: 0.2",
     "home.joints.arm::elbo: found arm::elbo; accepted: one of arm::elbow"),
    ("arm::elbow: 0.2", "arm::elbow: [1, 2]", "found 2 numbers; accepted: 1 [rad, m]"),
    ("arm::elbow: 0.2", "arm::elbow: 4", "within the joint's limits, -1..1"),
    ("arm::elbow: 0.2", "arm::elbow: a", "home.joints.arm::elbow"),
    ("{arm::elbow: 0.2}", "[1]", "home.joints: found [1]; accepted: a mapping from names"),
    ("elbow: 0.2", "elbow: 0.2, arm::elbow: 0.1", "found twice; accepted: once"),
    ("arm::platform: {", "arm::lower: {", "found arm::lower; accepted: one of arm::platform"),
    ("arm.dmd.yaml", "none.urdf", "mechanism: found none.urdf; accepted: a file that is there"),
    ("arm.dmd.yaml", "arm.txt", "accepted: a file that ends in .dmd.yaml"),
    ("arm.dmd.yaml", "package://none/arm.urdf", "accepted: a file of a package"),
    ("lower: 1,", "lower: 200,", "tension_bounds: found lower 200, upper 100"),
    ("name: E", "name: C1", "cables[1].name: found C1 twice"),
    ("exit_point: [0, 0.1, 0]", "exit_point: [0, 0.1, 1.0e5]", "cables[1].exit_point"),
    ("1.0e11", "1.0e14", "cable.youngs_modulus"),
    ("cables:", "gravity_direction: [0, 0, 0]\ncables:", "gravity_direction"),
    ("point: [0, 0.1, -0.1]}]", "point: [0, 0.02, -0.2]}]", "E cannot run"),
]  # fmt: skip


TWICE = DIRECTIVES.replace("- add_frame", "- add_model: {name: other, file: arm.urdf}\n- add_frame")
FILES = [
    ({"arm": "<robot name='arm'><link"}, "which Drake refuses"),
    ({"directives": "directives: [{add_nothing: {}}]"}, "which Drake refuses"),
    ({"directives": "directives: [\n"}, "which Drake refuses"),
    ({"directives": DIRECTIVES.replace("arm.urdf", "package://none/a.urdf")}, "none"),
    ({"arm": ARM.replace('child link="lower"', 'child link="platform"')}, "arm.dmd.yaml"),
    ({"arm": ARM.replace('mass value="1.0"', 'mass value="1e20"')}, "found an inertia beyond"),
    ({"arm": ARM.replace('"lower"', '"::"')}, "which Drake refuses"),
    ({"arm": ARM.replace(link("lower"), '<link name="lower"/>')}, "moves no mass"),
]


def refusal(path, text=MECHANISM):
    with pytest.raises(RobotFileError) as caught:
        parse_mechanism(text, path)
    assert len(str(caught.value).splitlines()) == 1
    assert str(caught.value).startswith(str(path))
    return str(caught.value)


@pytest.mark.parametrize(("old", "new", "words"), WRONG)
def test_what_is_wrong_is_said_in_one_line(tmp_path, old, new, words):
    assert old in MECHANISM
    assert words in refusal(write_small(tmp_path), MECHANISM.replace(old, new))


@pytest.mark.parametrize(("files", "words"), FILES)
def test_what_drake_refuses_is_one_line(tmp_path, files, words):
    path = write_small(tmp_path, **files)
    message = refusal(path)
    assert message.startswith(f"{path}: mechanism: found")
    assert words in message


def test_a_name_that_two_frames_bear(tmp_path):
    words = "found platform, which 2 bear; accepted: one of arm::"
    with pytest.raises(RobotFileError, match=words):  # of two cables, in a line each
        load_mechanism(write_small(tmp_path, directives=TWICE))


def test_mechanisms_and_robots_are_told_apart(tmp_path):
    assert set(mechanism_names()) == {
        "arm_on_platform", "bm_arm", "cable_arm", "mobile_bases", "two_platforms",
    }  # fmt: skip
    assert set(mechanism_names()).isdisjoint(robot_names())
    assert not any(is_mechanism(robot_file(name)) for name in robot_names())
    assert isinstance(load_robot_or_mechanism("planar"), Robot)
    assert isinstance(load_robot_or_mechanism(write_small(tmp_path)), Mechanism)
    with pytest.raises(RobotFileError, match="found a robot with one platform; accepted: a file"):
        load_mechanism("planar")
    with pytest.raises(RobotFileError, match="'nothing' is unknown"):
        load_mechanism("nothing")


def test_a_folder_may_hold_a_mechanism():
    folder = robot_file("cable_arm").parent
    assert load_mechanism(folder).name == "cable_arm"


@pytest.mark.parametrize("name", mechanism_names())
def test_shipped_ones_have_their_folder_and_a_readme(name):
    mechanism, folder = load_mechanism(name), robot_file(name).parent
    assert mechanism.name == folder.name == name
    readme = (folder / "README.md").read_text(encoding="utf-8")
    assert readme.startswith(f"# {name}\n")
    assert "licence" in readme
    assert mechanism.assumptions
