"""Robots of other tools come in as their files have them."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake import models
from cdpr_drake.errors import RobotFileError
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.straight_cables import cable_lengths
from tests.messages import printed
from tests.models.formats import foreign_files as files

EXACT = 1e-12
"""Points go through text with all their digits, and through a few rotations."""

R_30 = RollPitchYaw(0.0, 0.0, np.radians(30.0)).ToRotationMatrix()


def expected_lengths(X_WP):
    """|A B| by hand."""
    R, p = X_WP.rotation().matrix(), X_WP.translation()
    return np.array(
        [
            np.sqrt(sum((p + R @ B - A) ** 2))
            for A, B in zip(files.EXITS.T, files.ANCHORS.T, strict=True)
        ]
    )


def expected_wrench_matrix(X_WP):
    """Moments about Po, then forces, of unit tensions, by hand."""
    R, p = X_WP.rotation().matrix(), X_WP.translation()
    columns = []
    for A, B in zip(files.EXITS.T, files.ANCHORS.T, strict=True):
        u = (A - p - R @ B) / np.linalg.norm(A - p - R @ B)
        columns.append([*np.cross(R @ B, u), *u])
    return np.array(columns).T


READERS = {
    "caspr": (files.caspr, pose_from_angles(files.HOME, files.ANGLES)),
    "wirex": (files.wirex, None),
    "gazebo": (files.gazebo, RigidTransform(files.HOME)),
    "gazebo fork": (lambda f: files.gazebo(f, fork=True), RigidTransform(files.HOME)),
    "gazebo world": (lambda f: files.gazebo(f, world_points=True), RigidTransform(files.HOME)),
    "mjcf": (files.mjcf, RigidTransform(R_30, files.HOME)),
    "sdformat": (files.sdformat, RigidTransform(files.HOME)),
}


@pytest.mark.parametrize("kind", READERS)
def test_points_lengths_wrench_matrix_and_home(kind, tmp_path):
    if kind == "mjcf":
        pytest.importorskip("mujoco")
    write, home = READERS[kind]
    robot = models.load_robot(str(write(tmp_path)))
    cables = robot.cable_set().without_pulleys()
    np.testing.assert_allclose(cables.p_WA, files.EXITS, atol=EXACT)
    np.testing.assert_allclose(cables.p_PB, files.ANCHORS, atol=EXACT)
    if home is not None:
        found = robot.home.transform()
        np.testing.assert_allclose(found.GetAsMatrix4(), home.GetAsMatrix4(), atol=EXACT)
    X_WP = robot.home.transform() if home is None else home
    lengths = cable_lengths(X_WP, cables.p_WA, cables.p_PB)
    np.testing.assert_allclose(lengths, expected_lengths(X_WP), atol=EXACT)
    W = -cable_jacobian(X_WP, cables).T
    np.testing.assert_allclose(W, expected_wrench_matrix(X_WP), atol=EXACT)
    assert robot.platform.mass == files.MASS


@pytest.mark.parametrize("kind", ["caspr", "gazebo", "gazebo fork", "mjcf", "sdformat"])
def test_inertia_is_about_the_centre_of_mass(kind, tmp_path):
    if kind == "mjcf":
        pytest.importorskip("mujoco")
    robot = models.load_robot(str(READERS[kind][0](tmp_path)))
    spatial = models.platform_inertia(robot)
    com = np.zeros(3) if kind.startswith("gazebo") else files.COM
    np.testing.assert_allclose(spatial.get_com(), com, atol=EXACT)
    about = spatial.Shift(com).CalcRotationalInertia()
    found = [*about.get_moments(), *about.get_products()]
    np.testing.assert_allclose(found, files.INERTIA, atol=EXACT)


LISTED = "<!DOCTYPE cables [\n  <!ATTLIST cable_set id ID #REQUIRED>\n]>"
"""A document type as some files bring it along."""


def test_caspr_limits_sets_and_pulleys(tmp_path):
    imported = models.import_robot(files.caspr(tmp_path, pulley=True))
    robot = imported.robot
    assert robot.tension_limits() == (7.0, 700.0)  # every cable's own limits hold
    cables = robot.cable_set()
    np.testing.assert_allclose(cables.pulley_radius, 0.04 + 0.001 * np.arange(8), atol=EXACT)
    np.testing.assert_allclose(cables.swivel_axis[:, 3], np.array([0, 1, 1]) / np.sqrt(2))
    assert any("differ from cable to cable" in words for words in imported.completed.remarks)
    assert any("first" in words for words in imported.completed.remarks)
    with pytest.raises(RobotFileError, match="cable_set first"):
        models.import_robot(tmp_path, cable_set="first")


def test_caspr_points_relative_to_the_centre_of_mass(tmp_path):
    robot = models.load_robot(str(files.caspr(tmp_path, reference="com")))
    np.testing.assert_allclose(robot.cable_set().p_PB, files.ANCHORS, atol=EXACT)


def test_cables_of_one_name_are_told_apart(tmp_path):
    """A public model of eight cables calls its last one as its first."""
    path = files.caspr(tmp_path)
    cables = tmp_path / "toy_cables.xml"
    text = cables.read_text()
    assert 'name="cable 8"' in text
    text = text.replace('<!DOCTYPE cables SYSTEM "../../templates/cables.dtd">', LISTED)
    cables.write_text(text.replace('name="cable 8"', 'name="cable 1"'))
    imported = models.import_robot(path)
    assert [cable.name for cable in imported.robot.cables] == [f"C{k}" for k in range(1, 9)]
    np.testing.assert_allclose(imported.robot.cable_set().p_PB, files.ANCHORS, atol=EXACT)
    assert any("it became C8" in words for words in imported.completed.remarks)


def test_caspr_list_with_another_case(tmp_path):
    folder = tmp_path / "SCDM" / "TOY_Robot"
    folder.mkdir(parents=True)
    files.caspr(folder, name="toy")
    listed = tmp_path / "models_list.csv"
    listed.write_text("Toy,/SCDM/Toy_robot/,Toy_bodies.xml,Toy_cables.xml,t.xml,o.xml\n")
    imported = models.import_robot(listed, model="toy")
    assert imported.robot.name == "toy"
    with pytest.raises(RobotFileError, match="accepted: Toy"):
        models.import_robot(listed, model="other")


def test_caspr_planar_robot(tmp_path):
    path = files.caspr(tmp_path, joint="PLANAR_XY", q="0.1 0.2 0.3")
    robot = models.load_robot(str(path))
    assert robot.is_planar()
    np.testing.assert_allclose(robot.home.position, [0.1, 0.2, 0.0])
    np.testing.assert_allclose(robot.home.angles_deg, [0, 0, np.degrees(0.3)], atol=1e-9)


@pytest.mark.parametrize(
    ("joint", "q", "position", "angles", "rows"),
    [
        ("PLANAR_XZ", "0.1 1.2 0.3", [0.1, 0.0, 1.2], [0.0, 0.3, 0.0], (1, 3, 5)),
        ("PLANAR_YZ", "0.1 1.2 0.3", [0.0, 0.1, 1.2], [0.3, 0.0, 0.0], (0, 4, 5)),
        ("T_XYZ", "0.1 0.2 1.2", [0.1, 0.2, 1.2], [0.0, 0.0, 0.0], (3, 4, 5)),
        ("P_XY", "0.1 0.2", [0.1, 0.2, 0.0], [0.0, 0.0, 0.0], (3, 4)),
        ("P_XZ", "0.1 1.2", [0.1, 0.0, 1.2], [0.0, 0.0, 0.0], (3, 5)),
        ("P_YZ", "0.1 1.2", [0.0, 0.1, 1.2], [0.0, 0.0, 0.0], (4, 5)),
        ("P_Z", "1.2", [0.0, 0.0, 1.2], [0.0, 0.0, 0.0], (5,)),
    ],
)
def test_caspr_points_and_upright_planes(joint, q, position, angles, rows, tmp_path):
    imported = models.import_robot(files.caspr(tmp_path, joint=joint, q=q))
    robot = imported.robot
    motion = robot.motion_type()
    assert motion.rows == rows
    np.testing.assert_allclose(robot.home.position, position)
    np.testing.assert_allclose(np.radians(robot.home.angles_deg), angles, atol=1e-9)
    X_WP, cables = robot.home.transform(), robot.cable_set()
    R = X_WP.rotation().matrix()
    along = np.array(position)[:, np.newaxis] + R @ files.ANCHORS - files.EXITS
    np.testing.assert_allclose(
        cable_paths(X_WP, cables).lengths, np.linalg.norm(along, axis=0), atol=1e-12
    )
    if motion.is_point:  # eight anchor points that are not one
        np.testing.assert_array_equal(cables.p_PB, 0.0)
        assert any("does not turn" in words for words in imported.completed.remarks)


def test_a_point_mass_may_have_an_exit_point_in_the_origin(tmp_path):
    """A rectangle from the origin on, as point masses are published; all hold Po, 0 0 0 in P."""
    corners = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 0.8, 0.0], [0.0, 0.8, 0.0]]).T
    path = files.caspr(tmp_path, joint="P_XY", q="0.2 0.3", points=(corners, 0.0 * corners))
    robot = models.load_robot(str(path))
    np.testing.assert_array_equal(robot.exit_points(), corners)
    np.testing.assert_array_equal(robot.anchor_points(), 0.0)
    lengths = cable_lengths(robot.home.transform(), robot.exit_points(), robot.anchor_points())
    np.testing.assert_allclose(lengths, np.hypot([0.2, 0.3, 0.3, 0.2], [0.3, 0.3, 0.5, 0.5]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joint": "R_Z", "q": "0"}, "joint space, no cable robot"),
        ({"links": 2}, "2 bodies"),
        ({"q": "1 2"}, "6 finite numbers"),
        ({"q": "a b c d e f"}, "finite number"),
    ],
)
def test_what_is_no_cable_robot_is_refused_by_name(change, message, tmp_path):
    with pytest.raises(RobotFileError, match=message) as caught:
        models.load_robot(str(files.caspr(tmp_path, **change)))
    assert "\n" not in str(caught.value)


def test_wirex_winch_cable_and_what_is_odd(tmp_path):
    imported = models.import_robot(files.wirex(tmp_path))
    robot = imported.robot
    assert robot.name == "toy_1"
    assert robot.tension_limits() == (5.0, 720.0)
    assert robot.cable.diameter == 0.006
    assert robot.winch.drum_radius == 0.1
    assert robot.winch.inertia == 0.0015
    np.testing.assert_allclose(robot.cable_set().swivel_axis, np.tile([[0.0], [1.0], [0.0]], 8))
    np.testing.assert_allclose(robot.platform.inertia[:3], [14.0, 14.0, 14.0])
    assert any("Ixx only" in words for words in imported.completed.remarks)


def test_wirex_home_is_held_within_the_limits(tmp_path):
    robot = models.load_robot(str(files.wirex(tmp_path)))
    cables = robot.cable_set().without_pulleys()
    holding = models.hold_robot(robot, robot.home.transform(), cables, "elastic")
    assert np.all(holding.tensions >= 5.0 - 1e-6)


@pytest.mark.parametrize("old", [False, True])
def test_grab_both_schemas_and_trailing_commas(old, tmp_path):
    imported = models.import_robot(files.grab(tmp_path, old=old))
    robot, count = imported.robot, 4 if old else 3
    np.testing.assert_allclose(robot.cable_set().p_WA, files.EXITS[:, :count], atol=EXACT)
    np.testing.assert_allclose(robot.cable_set().p_PB, files.ANCHORS[:, :count], atol=EXACT)
    radii = [0.02] * 4 if old else [0.02, 0.021, 0.022]
    np.testing.assert_allclose(robot.cable_set().pulley_radius, radii)
    np.testing.assert_allclose(robot.cable_set().swivel_axis[:, 0], [0.0, 0.6, 0.8])
    assert robot.gravity == pytest.approx(9.80665)
    assert any("underactuated" in words for words in imported.completed.remarks)


def test_grab_tilted_gravity_keeps_the_file_s_frame(tmp_path):
    imported = models.import_robot(files.grab(tmp_path, tilt=True))
    p_WA = imported.robot.cable_set().p_WA
    np.testing.assert_allclose(p_WA, files.EXITS[:, :3], atol=EXACT)
    g = imported.robot.gravity_vector()
    np.testing.assert_allclose(g, -9.80665 * np.array([0.0, np.sin(0.02), np.cos(0.02)]))
    assert any("tilted by 1.146 deg" in words for words in imported.completed.remarks)


def test_gazebo_degrees_are_told(tmp_path):
    path = files.gazebo(tmp_path)
    path.write_text(path.read_text().replace("rpy: [0, 0, 0]", "rpy: [0, 0, 90]"))
    imported = models.import_robot(path)
    np.testing.assert_allclose(imported.robot.home.angles_deg, [0, 0, 90], atol=1e-9)
    assert any("degrees" in words for words in imported.completed.remarks)


@pytest.mark.parametrize(
    ("write", "old", "new", "message"),
    [
        (files.caspr, "</links>", "", "is not well-formed XML"),
        (files.wirex, 'mass="2.5"', 'mass="TODO"', "platform.mass: found TODO"),
        (files.gazebo, "mass: 2.5", "mass: <mass>", "platform.mass: found <mass>"),
        (files.gazebo, "size: [0.2, 0.2, 0.12]", "size: [0.2, 0.2]", "3 finite numbers"),
        (files.grab, '"mass": 2.5', '"mass": NaN', "platform.mass: found nan"),
        (files.grab, '"mass": 2.5', '"mass": ', "does not parse as JSON"),
        (files.sdformat, 'name="B_', 'name="Q_', "accepted: frames exit_NAME"),
    ],
)
def test_wrong_files_end_in_one_line(write, old, new, message, tmp_path):
    path = write(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(RobotFileError) as caught:
        models.load_robot(str(path))
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


def test_frames_without_a_partner_are_named(tmp_path):
    path = files.sdformat(tmp_path)
    path.write_text(path.read_text().replace('name="B_0"', 'name="Q_0"'))
    imported = models.import_robot(path)
    assert len(imported.robot.cables) == 7
    assert any(words.endswith("partner: 0") for words in imported.completed.remarks)


def test_an_import_says_what_it_assumed(tmp_path):
    imported = models.import_robot(files.caspr(tmp_path))
    assert "cable.youngs_modulus" in imported.completed.assumed
    assert "cables[].exit_point" in imported.completed.given
    assert "cable.youngs_modulus" in imported.readme()
    own = tmp_path / "robot.yaml"
    own.write_text(imported.yaml())
    again = models.load_robot(str(own))
    np.testing.assert_array_equal(again.cable_set().p_WA, imported.robot.cable_set().p_WA)
    assert again.assumptions == imported.robot.assumptions


def test_what_mujoco_warns_of_is_said_and_no_file_is_left(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    text = next(iter(models.export_robot("acrobot_small", "mjcf").values()))
    file = tmp_path / "bad.xml"
    file.write_text(re.sub(r'springlength="0(\.0)? [^"]*"', 'springlength="0 nan"', text, count=1))
    assert "nan" in file.read_text()
    assert any("NaN" in words for words in models.import_robot(file).completed.remarks)
    assert [path.name for path in tmp_path.iterdir()] == ["bad.xml"]
    assert printed(capfd).err == ""
