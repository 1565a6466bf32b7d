"""What readers keep of files of other tools, by hand, and what they name as not kept."""

import json

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from scipy.io import savemat

import cdpr_drake as cdpr
from cdpr_drake import formats, models
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.caspr import caspr_models, read_caspr
from cdpr_drake.formats.detection import read_foreign
from cdpr_drake.formats.grab_mat import is_grab_mat
from cdpr_drake.geometry.cable_paths import cable_jacobian, cable_paths
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.geometry.straight_cables import cable_lengths
from cdpr_drake.models.foreign_text import read_json
from tests.messages import printed
from tests.models.formats import foreign_files as files
from tests.models.formats.foreign_files import ANCHORS, COM, EXITS, HOME, edited, saved, words
from tests.models.formats.rich_files import MJCF, SDF, SITES, SLIDER, URDF, hung, joined, slid, urdf
from tests.models.formats.test_refusals import FIRST, MESH, SHELL, WHOLE, attachment, toy

pytestmark = pytest.mark.usefixtures("in_this_process")

EXACT = 1e-12
"""Points go through text with all their digits, and through a few rotations."""

LEVEL, TURNED = np.zeros(3), np.array([0.0, 0.0, np.radians(30.0)])
READERS = {
    "caspr": (files.caspr, files.ANGLES, COM),
    "caspr com": (toy(reference="com"), files.ANGLES, COM),
    "wirex": (files.wirex, None, None),
    "gazebo": (files.gazebo, LEVEL, LEVEL),
    "gazebo fork": (lambda folder: files.gazebo(folder, fork=True), LEVEL, LEVEL),
    "gazebo world": (lambda folder: files.gazebo(folder, world_points=True), LEVEL, LEVEL),
    "mjcf": (files.mjcf, TURNED, COM),
    "sdformat": (files.sdformat, LEVEL, COM),
}


@pytest.mark.parametrize("kind", READERS)
def test_points_home_lengths_wrench_matrix_and_inertia(kind, tmp_path):
    if kind == "mjcf":
        pytest.importorskip("mujoco")
    write, angles, com = READERS[kind]
    robot = models.load_robot(str(write(tmp_path)))
    cables, X_WP = robot.cable_set().without_pulleys(), robot.home.transform()
    np.testing.assert_allclose(cables.p_WA, EXITS, atol=EXACT)
    np.testing.assert_allclose(cables.p_PB, ANCHORS, atol=EXACT)
    if angles is not None:
        home = pose_from_angles(HOME, angles).GetAsMatrix4()
        np.testing.assert_allclose(X_WP.GetAsMatrix4(), home, atol=EXACT)
    arms = X_WP.rotation().matrix() @ ANCHORS
    along = EXITS - X_WP.translation()[:, np.newaxis] - arms
    lengths = np.linalg.norm(along, axis=0)
    np.testing.assert_allclose(cable_lengths(X_WP, cables.p_WA, cables.p_PB), lengths, atol=EXACT)
    W = np.vstack([np.cross(arms.T, (along / lengths).T).T, along / lengths])
    np.testing.assert_allclose(-cable_jacobian(X_WP, cables).T, W, atol=EXACT)
    assert robot.platform.mass == files.MASS
    if com is not None:
        spatial = models.platform_inertia(robot)
        np.testing.assert_allclose(spatial.get_com(), com, atol=EXACT)
        about = spatial.Shift(com).CalcRotationalInertia()
        found = [*about.get_moments(), *about.get_products()]
        np.testing.assert_allclose(found, files.INERTIA, atol=EXACT)


def limits(low, high):
    """Limits of the toy's joint, which stands off the world's origin."""
    given = "".join(f' {key}="{w}"' for key, w in (("q_min", low), ("q_max", high)) if w)
    return [('"/><physical>', f'"{given}/><physical>'),
            ("<location>0 0 0<", "<location>0.1 0.2 0.3<")]  # fmt: skip


def corners(low, high):
    return {"frame_lower": low, "frame_upper": high}


def chain(*items):
    """The first cable of the toy through other attachments."""
    old = attachment(0, EXITS[:, 0]) + attachment(1, ANCHORS[:, 0])
    return [(old, "".join(attachment(*item) for item in items))]


def ends(exit_point):
    return {"cables.0.exit_point": exit_point, "cables.0.anchor_point": END}


ONE, TWO, END = np.array([1.0, 0.0, 2.0]), np.array([2.0, 0.5, 1.0]), np.array([0.1, 0.2, 0.0])
SHOWN, LIMITED = corners([-3, -3, 0], [3, 3, 3]), "limits of the joint"
LOW, HIGH = "-3.15 -3.15 -3.15", "3.15 3.15 3.15"
RANGE = 'display_range="-3 3 -3 3 0 3">'
X, Y, Z = COM
STEINER = files.MASS * np.array(
    [Y * Y + Z * Z, X * X + Z * Z, X * X + Y * Y, -X * Y, -X * Z, -Y * Z]
)
QUATERNION = np.array([np.cos(0.2), 0.0, np.sin(0.2), 0.0])
ABOUT_Y = [[np.cos(0.4), 0, np.sin(0.4)], [0, 1, 0], [-np.sin(0.4), 0, np.cos(0.4)]]
QUARTER = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
LISTED = "<!DOCTYPE cables [\n  <!ATTLIST cable_set id ID #REQUIRED>\n]>"
FLAT_Z = {"gravity_direction": [0.0, -np.sin(0.02), -np.cos(0.02)]}
PULLEYS, LOAD = toy(pulley=True), '"platform": {"ext_force_loc": '
LAST = "gear_ratio: 51:4\nanchor_x: 0\nanchor_y: 0"
"""Of Klipper's fourth winch."""

MATERIAL = {"diameter": 0.006, "drum_radius": 0.1, "motor_inertia": 0.0015, "cables.0.lower": 5.0,
            "cables.0.upper": 720.0, "cables.7.swivel_axis": [0, 1, 0], "name": "toy_1",
            "inertia": [14, 14, 14, 0, 0, 0]}  # fmt: skip
GRAB_3 = {"cables.2.exit_point": EXITS[:, 2], "cables.2.anchor_point": ANCHORS[:, 2],
          "cables.0.swivel_axis": [0, 0.6, 0.8]}  # fmt: skip
OLD_NAMES = [("pos_D_glob", "pos_glob_D"), ("pos_A_loc", "pos_loc_A"), ("pos_G_loc", "pos_loc_G"),
             ("inertia_mat_G_loc", "inertia_mat_loc_G")]  # fmt: skip
OLD = {**GRAB_3, "cables.3.pulley_radius": 0.02, "center_of_mass": COM, "inertia": files.INERTIA}
WALL = {"cables.0.exit_point": [0.1, 0.1, 2.4], "axis": [0, 1, 0]}
FLOOR = {"cables.0.exit_point": [0.1, 2.4, -0.1], "cables.1.exit_point": [3.6, 2.41, -0.056],
         "cables.3.exit_point": [3.61, 0, -0.078]}  # fmt: skip
OLD_MASLOW = "Maslow_vertical: false\n" + "".join(
    f"Maslow_{key}: {value}\n"
    for key, value in {"tlX": 100, "tlY": 2400, "tlZ": 100, "trX": 3600, "trY": 2410, "trZ": 56,
                       "brX": 3610, "brY": 0, "brZ": 78, "blY": 0, "armLength": 120}.items()
)  # fmt: skip


WINCH = "[winch]\nmover_weight: 5.5\noddity: 3\n[extruder]"


def old_grab(folder):
    return files.grab(folder, old=True)


# name -> (what writes the file, changes of its words, what the draft has, remarks, no remarks)
KEPT = {
    "older joint": (files.caspr, [(WHOLE, "<joint_type> spatial_euler_xyz </joint_type>")],
                    {"motion": "3R3T", "home_position": None}, [], []),
    "limits": (files.caspr, limits(f"-1 -2 0 {LOW}", f"1 2 3 {HIGH}"),
               {**corners([-0.9, -1.8, 0.3], [1.1, 2.2, 3.3]), "home_position": [0.3, 0.1, 1.4]},
               [LIMITED], []),
    "one axis does not move": (files.caspr, limits(f"-1 0 0 {LOW}", f"1 0 3 {HIGH}"), SHOWN, [],
                               [LIMITED]),
    "none that anybody has built": (files.caspr, limits(f"-1 -9999 0 {LOW}", f"1 9999 3 {HIGH}"),
                                    SHOWN, [], [LIMITED]),
    "limits far off": (files.caspr, limits(f"-1e9 -1e9 0 {LOW}", f"-1 -2 3 {HIGH}"), SHOWN, [],
                       [LIMITED]),
    "lower limit": (files.caspr, limits(f"-1 -2 0 {LOW}", None), SHOWN, [], [LIMITED]),
    "upper limit": (files.caspr, limits(None, f"1 2 3 {HIGH}"), SHOWN, [], [LIMITED]),
    "two limits": (toy(joint="P_XZ", q="0.1 1.2"), [('="0.1 1.2"', '="0.1 1.2" q_min="-1 0"'
                   ' q_max="1 2"')], SHOWN, [], []),
    "range": (files.caspr, [(RANGE, "><display_range>-3 3 -3 3 0 3</display_range>")], SHOWN,
              [], []),
    "flat range": (files.caspr, [(RANGE, RANGE.replace("0 3", "3 3"))], {"frame_lower": None},
                   [], []),
    "empty range": (files.caspr, [(RANGE, 'display_range="">')], {"frame_lower": None}, [], []),
    "no range": (files.caspr, [(RANGE, ">")], {"frame_lower": None}, [], []),
    "world first": (files.caspr, chain((0, ONE), (1, END)), ends(ONE), [], ["runs over"]),
    "body first": (files.caspr, chain((1, END), (0, ONE)), ends(ONE), [], ["runs over"]),
    "next to the body": (files.caspr, chain((0, ONE), (0, TWO), (1, END)), ends(TWO),
                         ["runs over 2 points"], []),
    "body, then world": (files.caspr, chain((1, END), (0, ONE), (0, TWO)), ends(ONE),
                         ["runs over 2 points"], []),
    "pulleys": (PULLEYS, [], {"cables.7.pulley_radius": 0.047, "cables.7.lower": 7.0,
                "cables.7.upper": 707.0, "cables.3.swivel_axis": np.sqrt([0, 0.5, 0.5])},
                ["first"], []),
    "no radius": (PULLEYS, [("<pulley_radius>0.04<", "<pulley_radius>0<")],
                  {"cables.0.pulley_radius": 0.0, "cables.0.swivel_axis": np.sqrt([0, 0.5, 0.5])},
                  [], []),
    **{f"cable {name}": (files.caspr, [('name="cable 3"', f'name="{name}"')],
                         {"cables.2.name": short}, [], [])
       for name, short in [("cable 3", "C3"), ("Cable_3", "C3"), ("3", "C3"),
                           ("cable a", "cable a"), ("C3b", "C3b")]},
    "one name": (files.caspr, [('name="cable 8"', 'name="cable 1"'),
                 ("<!DOCTYPE cables [<!ATTLIST cable_set id ID #REQUIRED>]>", LISTED)],
                 {"cables.7.anchor_point": ANCHORS[:, 7]}, [], []),
    "no default": (files.caspr, [(' default_cable_set="second"', ""),
                   (FIRST, "")], {"cables.7.name": "C8"}, [], ["also has"]),
    "springs": (files.caspr, [("cable_ideal", "cable_linear_spring")], {},
                ["Cables are of the kind cable_linear_spring; their stiffness was not kept."], []),
    "about the joint": (files.caspr, [('ia ref="com"', 'ia ref="joint"')],
                        {"inertia": files.INERTIA - STEINER}, ["Inertia is given about joint"], []),
    "quaternion": (toy(joint="SPATIAL_QUATERNION", q=words([*HOME, *QUATERNION])), [],
                   {"R_WP": ABOUT_Y}, [], []),
    "long quaternion": (toy(joint="SPATIAL_QUATERNION", q=words([*HOME, *(7 * QUATERNION)])), [],
                        {"R_WP": ABOUT_Y}, [], []),
    "degrees": (toy(q=f"{words(HOME)} 0 0 90"), [], {"R_WP": QUARTER}, ["degrees"], []),
    "radians": (toy(q=f"{words(HOME)} 0 0 6.28"), [], {}, [], ["degrees"]),
    **{f"product {w}": (files.caspr, [("<Ixy>0.01</Ixy>", w)],
                        {"inertia": [0.1, 0.2, 0.25, 0, 0, -0.02]}, [], [])
       for w in ("<Ixy/>", "<Ixy> </Ixy>", "")},
    "level plane": (toy(joint="PLANAR_XY", q="0.1 0.2 0.3"),
                    [("<location>0 0 0<", "<location>0.5 0 0.7<")],
                    {"plane_height": 0.7, "home_position": [0.6, 0.2, 0.7]}, [], []),
    "wirex": (files.wirex, [], MATERIAL, ["Ixx only"], []),
    "grab": (files.grab, [], {**GRAB_3, "cables.2.pulley_radius": 0.022, "inertia": files.INERTIA},
             ["Commas before a closing bracket were let pass: 2, the first in"], []),
    "old grab": (old_grab, [], OLD, [], []),
    "oldest grab": (old_grab, OLD_NAMES, OLD, [], []),
    "tilted gravity": (lambda f: files.grab(f, tilt=True), [], {**GRAB_3, **FLAT_Z},
                       ["tilted by 1.146 deg"], []),
    "loose numbers": (files.grab, [("[-2.0]", "[-2.]")], GRAB_3,
                      ["Numbers that strict JSON refuses were read: 2, the first -2. in"], []),
    "unlike drums": (lambda f: files.grab_on_board(f, drums=(0.06, 0.08)), [],
                     {"drum_radius": None}, ["Drums differ"], []),
    "platform pulleys": (files.grab_on_board, [], {"drum_radius": 0.03},
                         ["Keys that were not kept: h, l0, rotation_parametrization, swivel0, "
                          "transmission_ratio, vers_i_loc."], []),
    **{f"{key} {what}": (files.grab_on_board, [(LOAD[:13], f'"platform": {{"{key}": {load}, ')], {},
                         [said] if load[2] else [], [] if load[2] else [said])
       for key in ("ext_force_loc", "ext_torque_loc", "ext_moments_loc")
       for said in [f"platform.{key} is a load and was not kept."]
       for what, load in [("on the platform", [0.0, 0.0, -5.0]), ("of zero", [0.0, 0.0, 0.0])]},
    "gazebo degrees": (files.gazebo, [("rpy: [0, 0, 0]", "rpy: [0, 0, 90]")], {"R_WP": QUARTER},
                       ["degrees"], []),
    "no partner": (files.sdformat, [('name="B_0"', 'name="Q_0"')], {"cables.6.name": "7"},
                   ["partner: 0"], []),
    "klipper": (files.klipper, [("[extruder]", WINCH)],
                {"motion": "3T", "cables.1.exit_point": [2, 1, -0.1], "gear_ratio": 12.75,
                 "drum_radius": 0.04 / (2 * np.pi), "cable_speed": 0.3, "cables.3.name": "D",
                 "mass": 5.5},
                ["Not kept: printer.max_accel, winch.oddity, extruder.",
                 "Included files were not read: mcu.cfg.",
                 "Keys of steppers that were not kept: step_pin."], []),
    "klipper drums": (files.klipper, [("40\n" + LAST, "50\n" + LAST)],
                      {"cables.3.drum_radius": 0.05 / (2 * np.pi), "cables.0.drum_radius": None,
                       "drum_radius": 0.04 / (2 * np.pi)}, [], []),
    "klipper gears": (files.klipper, [(LAST, LAST.replace("51:4", "9:1"))],
                      {"drum_radius": None}, ["Gears differ from winch to winch"], []),
    "reprapfirmware": (files.reprap, [],
                       {"cables.3.exit_point": [0, 0, 2.345], "gear_ratio": 12.75, "mass": 2.5,
                        "cables.3.mechanical_advantage": 2.0, "drum_radius": 0.065 - 0.5e-3,
                        "cables.0.lower": 4.0, "cables.0.upper": 90.0},
                       ["Parameters of M669 that were not kept: P.", "Commands that were not read: "
                        "M92.", "Parameters of M666 that were not kept: Z."], []),
    "anchor as a height": (files.reprap, [("D0:0:2345.0", "D2345.0")],
                           {"cables.3.exit_point": [0, 0, 2.345]}, [], []),
    "maslow on a wall": (files.maslow, [], WALL, ["Not kept: name, kinematics.Cartesian, "
                         "kinematics.MaslowKinematics.oddity."], []),
    "maslow on a floor": (files.maslow, [("true", "false")], {**FLOOR, "arm": 0.1534}, [], []),
    "old maslow": (files.saved("old.yaml", OLD_MASLOW), [], {**FLOOR, "arm": None},
                   ["120 mm before the middle"], []),
}  # fmt: skip


def look(draft, key):
    """A value of a draft, `cables.0.name` for that of an item."""
    for name in key.split("."):
        draft = draft[int(name)] if name.isdigit() else getattr(draft, name)
    return draft


@pytest.mark.parametrize(("write", "changes", "kept", "said", "silent"), KEPT.values(), ids=KEPT)
def test_what_is_kept_and_what_is_named(write, changes, kept, said, silent, tmp_path):
    path = write(tmp_path)
    edited(tmp_path, *changes)
    draft = read_foreign(path)
    for key, expected in kept.items():
        found = look(draft, key)
        if expected is None or isinstance(expected, str):
            assert found == expected, key
        else:
            np.testing.assert_allclose(found, expected, rtol=EXACT, atol=EXACT, err_msg=key)
    remarks = "\n".join(draft.remarks)
    for part in said:
        assert part in remarks
    for part in silent:
        assert part not in remarks


@pytest.mark.parametrize(
    ("joint", "q", "position", "angles", "rows"),
    [
        ("PLANAR_XY", "0.1 0.2 0.3", [0.1, 0.2, 0.0], [0.0, 0.0, 0.3], (2, 3, 4)),
        ("PLANAR_XZ", "0.1 1.2 0.3", [0.1, 0.0, 1.2], [0.0, 0.3, 0.0], (1, 3, 5)),
        ("PLANAR_YZ", "0.1 1.2 0.3", [0.0, 0.1, 1.2], [0.3, 0.0, 0.0], (0, 4, 5)),
        ("T_XYZ", "0.1 0.2 1.2", [0.1, 0.2, 1.2], [0.0, 0.0, 0.0], (3, 4, 5)),
        ("P_XY", "0.1 0.2", [0.1, 0.2, 0.0], [0.0, 0.0, 0.0], (3, 4)),
        ("P_XZ", "0.1 1.2", [0.1, 0.0, 1.2], [0.0, 0.0, 0.0], (3, 5)),
        ("P_YZ", "0.1 1.2", [0.0, 0.1, 1.2], [0.0, 0.0, 0.0], (4, 5)),
        ("P_Z", "1.2", [0.0, 0.0, 1.2], [0.0, 0.0, 0.0], (5,)),
    ],
)
def test_joints_of_caspr_are_motion_types(joint, q, position, angles, rows, tmp_path):
    imported = formats.import_robot(files.caspr(tmp_path, joint=joint, q=q))
    robot = imported.robot
    motion = robot.motion_type()
    assert motion.rows == rows
    assert robot.is_planar() == (joint == "PLANAR_XY")
    np.testing.assert_allclose(robot.home.position, position)
    np.testing.assert_allclose(np.radians(robot.home.angles_deg), angles, atol=1e-9)
    if joint == "PLANAR_XY":  # whose cables lie in its plane here
        return
    X_WP, cables = robot.home.transform(), robot.cable_set()
    along = np.array(position)[:, np.newaxis] + X_WP.rotation().matrix() @ ANCHORS - EXITS
    lengths = np.linalg.norm(along, axis=0)
    np.testing.assert_allclose(cable_paths(X_WP, cables).lengths, lengths, atol=EXACT)
    if motion.is_point:  # eight anchor points that are not one
        np.testing.assert_array_equal(cables.p_PB, 0.0)
        assert any("does not turn" in said for said in imported.completed.remarks)


def test_a_point_mass_may_have_an_exit_point_in_the_origin(tmp_path):
    """A rectangle from the origin on, as point masses are published; all hold Po, 0 0 0 in P."""
    square = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 0.8, 0.0], [0.0, 0.8, 0.0]]).T
    path = files.caspr(tmp_path, joint="P_XY", q="0.2 0.3", points=(square, 0.0 * square))
    robot = models.load_robot(str(path))
    np.testing.assert_array_equal(robot.exit_points(), square)
    np.testing.assert_array_equal(robot.anchor_points(), 0.0)
    lengths = cable_lengths(robot.home.transform(), robot.exit_points(), robot.anchor_points())
    np.testing.assert_allclose(lengths, np.hypot([0.2, 0.3, 0.3, 0.2], [0.3, 0.3, 0.5, 0.5]))


def test_lists_of_caspr_and_names_of_its_files(tmp_path):
    """A file's name must end in .xml; space before and after it, and its case, do not count."""
    folder = tmp_path / "SCDM" / "TOY_Robot"
    folder.mkdir(parents=True)
    files.caspr(folder)
    listed = tmp_path / "list.csv"
    listed.write_text(
        "name,folder,bodies,cables\n"
        "half,/half/,half_bodies.xml,half_cables.txt,t.xml\n"
        "other half,/half/,half_bodies.txt,half_cables.xml,t.xml\n"
        "short,/short/,short_bodies.xml\n"
        " Toy , /SCDM/Toy_robot/ , Toy_bodies.xml,Toy_cables.xml\n"
    )
    there = tmp_path / "SCDM" / "Toy_robot"
    assert caspr_models(listed) == {"Toy": (there / "Toy_bodies.xml", there / "Toy_cables.xml")}
    assert read_caspr(listed, "TOY").name == "toy"
    assert formats.import_robot(listed, model="toy").robot.name == "toy"
    assert models.load_robot(str(folder)).name == "toy"
    (folder / "toy_bodies.xml").rename(folder / "toy_body_properties.xml")
    (folder / "toy_cables.xml").rename(folder / "TOY_cable_properties.XML")
    assert len(read_caspr(folder / "toy_body_properties.xml").cables) == 8
    assert len(read_caspr(folder / "toy_body_properties.xml", cable_set="second").cables) == 8


def test_a_passive_spring_is_left_out_by_name(tmp_path):
    path = files.caspr(tmp_path)
    cables = tmp_path / "toy_cables.xml"
    edited(tmp_path, ('<cable_ideal name="cable 8"', '<cable_passive name="cable 8"'))
    head, _, tail = cables.read_text().rpartition("</cable_ideal>")
    cables.write_text(f"{head}</cable_passive>{tail}")
    draft = read_caspr(path)
    assert [cable.name for cable in draft.cables] == [f"C{k}" for k in range(1, 8)]
    assert "cable 8, a passive spring, was left out." in draft.remarks
    assert not any("of the kind" in said for said in draft.remarks)


def test_an_import_says_what_it_assumed_and_what_it_made_of_limits_and_names(tmp_path):
    path = files.caspr(tmp_path, pulley=True)
    edited(tmp_path, ('name="cable 8"', 'name="cable 1"'))  # as a public model has it
    imported = formats.import_robot(path)
    assert "cable.youngs_modulus" in imported.completed.assumed
    assert "cables[].exit_point" in imported.completed.given
    assert "cable.youngs_modulus" in imported.readme()
    assert imported.robot.tension_limits() == (7.0, 700.0)  # every cable's own limits hold
    assert [cable.name for cable in imported.robot.cables] == [f"C{k}" for k in range(1, 9)]
    remarks = "\n".join(imported.completed.remarks)
    assert "differ from cable to cable" in remarks
    assert "it became C8" in remarks
    again = models.load_robot(str(files.saved("robot.yaml", imported.yaml())(tmp_path)))
    np.testing.assert_array_equal(again.cable_set().p_WA, imported.robot.cable_set().p_WA)
    assert again.assumptions == imported.robot.assumptions
    underactuated = formats.import_robot(files.grab(tmp_path))
    assert underactuated.robot.gravity == pytest.approx(9.80665)
    assert any("underactuated" in said for said in underactuated.completed.remarks)


def test_wirex_home_is_held_within_the_limits(tmp_path):
    robot = models.load_robot(str(files.wirex(tmp_path)))
    cables = robot.cable_set().without_pulleys()
    holding = models.hold_robot(robot, robot.home.transform(), cables, "elastic")
    assert np.all(holding.tensions >= 5.0 - 1e-6)


def test_what_mujoco_warns_of_is_said_and_no_file_is_left(tmp_path, monkeypatch, capfd):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    files.mjcf(tmp_path)
    edited(tmp_path, ('width="0.002"', 'width="0.002" springlength="0 nan"'))
    imported = formats.import_robot(tmp_path / "toy.xml")
    assert any("NaN" in said for said in imported.completed.remarks)
    assert [path.name for path in tmp_path.iterdir()] == ["toy.xml"]
    assert printed(capfd).err == ""


def grab_length(A_W, D_P, k_P, r, X_WP):
    """Length from D over the pulley to A as GRAB's kinematics has it, in P [m].

    With u from D to A across k: tan(psi / 2) = k'DA / s + sqrt(1 - 2 r / s + (k'DA / s)^2), where
    s = u'DA, and psi the angle that the pulley leaves of half a turn.
    """
    DA = X_WP.inverse().multiply(A_W) - D_P
    across = DA - k_P * (k_P @ DA)
    u, s = across / np.linalg.norm(across), np.linalg.norm(across)
    slope = k_P @ DA / s
    psi = 2.0 * np.arctan(slope + np.sqrt(1.0 - 2.0 * r / s + slope**2))
    n = u * np.cos(psi) + k_P * np.sin(psi)
    return np.linalg.norm(DA - r * (u + n)) + r * (np.pi - psi)


def test_pulleys_on_the_platform_by_the_formula_of_grab(tmp_path):
    imported = formats.import_robot(files.grab_on_board(tmp_path))
    cables = imported.robot.cable_set()
    np.testing.assert_allclose(cables.p_WA, EXITS, atol=EXACT)
    np.testing.assert_allclose(cables.p_PB, ANCHORS, atol=EXACT)
    np.testing.assert_array_equal(cables.pulley_radius, 0.0)
    np.testing.assert_allclose(cables.anchor_pulley_radius, files.RADIUS)
    k = np.array([files.AXES[i % 4] for i in range(8)]).T
    np.testing.assert_allclose(cables.anchor_swivel_axis, k, atol=EXACT)
    X_WP = pose_from_angles(HOME, files.ANGLES)
    expected = [grab_length(A, D, axis, files.RADIUS, X_WP)
                for A, D, axis in zip(EXITS.T, ANCHORS.T, k.T, strict=True)]  # fmt: skip
    np.testing.assert_allclose(cable_paths(X_WP, cables).lengths, expected, atol=EXACT)
    assert imported.robot.winch.drum_radius == 0.03
    assert {"cables[].anchor_pulley_radius", "winch.drum_radius"} <= set(imported.completed.given)
    assert "pulley.radius" not in imported.completed.assumed
    unlike = formats.import_robot(files.grab_on_board(tmp_path, drums=(0.06, 0.08)))
    assert "winch.drum_radius" in unlike.completed.assumed


SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 1.0
MIDDLE = [[0.0, 0.0, 0.1]] * 4
FLAT = {
    "ONE_R_TWO_T": (np.insert(SQUARE, 1, 0.2, axis=1), np.insert(0.1 * SQUARE, 1, 0.1, axis=1)),
    "TWO_T": (np.insert(SQUARE, 2, 0.5, axis=1), np.array(MIDDLE)),
    "THREE_T": (np.insert(SQUARE, 2, 2.5, axis=1), np.array(MIDDLE)),
}


def patterned(folder, pattern, points):
    """A robot of GRAB without pulleys."""
    cables = [{"pos_OD_glob": A.tolist(), "pos_PA_loc": B.tolist(), "vers_k": [0, 0, 1]}
              for A, B in zip(*points, strict=True)]  # fmt: skip
    content = {"motion_pattern": pattern, "cable": cables, "platform": {"mass": 2.0}}
    return formats.import_robot(files.saved("flat.json", json.dumps(content))(folder))


@pytest.mark.parametrize(
    ("pattern", "rows", "along", "at"),
    [
        ("ONE_R_TWO_T", (1, 3, 5), 1, 0.1),
        ("TWO_T", (3, 4), 2, 0.5),
        ("THREE_T", (3, 4, 5), 2, None),
    ],
)
def test_motion_patterns(pattern, rows, along, at, tmp_path):
    """A platform in a plane keeps the distance at which its cables lie in that plane."""
    imported = patterned(tmp_path, pattern, FLAT[pattern])
    robot = imported.robot
    assert robot.motion_type().rows == rows
    assert not any("motion_pattern" in said for said in imported.completed.remarks)
    if at is not None:
        assert robot.home.position[along] == pytest.approx(at)
    if robot.motion_type().is_plane:
        cables = robot.cable_set()
        ends = robot.home.transform().multiply(cables.p_PB) - cables.p_WA
        np.testing.assert_allclose(ends[along], 0.0, atol=EXACT)


@pytest.mark.parametrize(
    ("pattern", "like"), [("ONE_R_TWO_T", "THREE_T"), ("HOP", "THREE_T"), (3, "TWO_T")]
)
def test_motion_patterns_that_do_not_fit_are_told(pattern, like, tmp_path):
    exits, anchors = FLAT[like]
    exits = np.vstack([exits[:3], [-1.0, 1.0, 2.0]])
    imported = patterned(tmp_path, pattern, (exits, anchors))
    assert imported.robot.motion == "3R3T"
    said = f"motion_pattern {pattern} was read as a free body, 3R3T."
    assert said in imported.completed.remarks


@pytest.mark.parametrize(
    ("word", "value"),
    [("0.", 0.0), ("-0.", 0.0), (".5", 0.5), ("-.25", -0.25), ("2.e1", 20.0), (".5E-1", 0.05)],
)
def test_numbers_with_digits_on_one_side_of_the_point(word, value, tmp_path):
    text = f'{{"a": "0. and .5, ]",\n"b": [1.5, {word},\n{word}], "c": -1.25e-3, "d": 7}}'
    content, remarks = read_json(files.saved("toy.json", text)(tmp_path))
    assert content == {"a": "0. and .5, ]", "b": [1.5, value, value], "c": -0.00125, "d": 7}
    said = f"Numbers that strict JSON refuses were read: 2, the first {word} in line 2."
    assert remarks == [said]


@pytest.mark.parametrize(
    "text", ['{"a": 1.5, "b": [1e5, -0.25]}', '[".5", "1.", "a, ]"]', '"0."', "[1.5e-7, 10]"]
)
def test_strict_json_is_read_as_it_is(text, tmp_path):
    assert read_json(files.saved("toy.json", text)(tmp_path)) == (json.loads(text), [])


def test_robots_of_grab_in_matlab(tmp_path):
    """As its tools nest them; the platform's mass may be one number."""
    frame, points, pulleys = (np.empty(n, object) for n in (3, 4, 4))
    frame[:] = [np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])]
    for k, (x, y) in enumerate([(1, -1), (1, 1), (-1, 1), (-1, -1)]):
        points[k] = np.array([0.1 * x, 0.1 * y, 0.2])
        pulleys[k] = {"r": 0.03, "CableEnterPosition": [x, y, 1.8], "FixedFrame": frame}
    platform = {"m": 12.0, "PtoG": [0.0, 0.0, 0.15], "points": points,
                "InertialMatrix": np.diag([0.2, 0.1, 0.25])}  # fmt: skip
    robot = {"EndEffector": {"Platform": platform}, "Trasmission": {"Pulley": pulleys}}
    path = tmp_path / "robot.mat"
    savemat(path, {"s": robot})
    assert is_grab_mat(path)
    draft = read_foreign(path)
    assert draft.mass == 12.0
    np.testing.assert_allclose(draft.exit_points()[:, 2], [-1.0, 1.0, 1.8])
    np.testing.assert_allclose(draft.cables[0].swivel_axis, [1.0, 0.0, 0.0])
    platform["m"] = [1.0, 2.0]
    savemat(path, {"s": robot})
    with pytest.raises(RobotFileError, match=r"Platform.m: found .*; accepted: 1 finite numbers"):
        read_foreign(path)


# Bodies that move as one are summed, by Drake's and MuJoCo's sums; joints are motion types.


def full(xx, yy, zz, xy, xz, yz):
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def drake_sum(path):
    """Mass, centre and inertia about it of the platform and what it carries, in P."""
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    bodies = [plant.GetBodyByName(name) for name in ("platform", "gripper")]
    indices = [body.index() for body in bodies]
    context = plant.CreateDefaultContext()
    found = plant.CalcSpatialInertia(context, bodies[0].body_frame(), indices)
    com = found.get_com()
    return found.get_mass(), com, found.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()


@pytest.mark.parametrize("joint", ["fixed", "revolute"])
@pytest.mark.parametrize(("name", "text"), [("rich.urdf", URDF), ("rich.sdf", SDF)])
def test_links_of_a_platform_are_summed_as_by_drake(name, text, joint, tmp_path):
    yaw = 'name="yaw" type="{}"'
    text = text.replace(yaw.format("revolute"), yaw.format(joint))
    draft = read_foreign(saved(name, text)(tmp_path))
    hangs = 'name="hangs" type="{}"'
    fixed = URDF.replace(hangs.format("floating"), hangs.format("fixed"))
    mass, com, inertia = drake_sum(saved("fixed.urdf", fixed)(tmp_path))
    assert draft.mass == pytest.approx(mass) == pytest.approx(2.3)
    np.testing.assert_allclose(draft.center_of_mass, com, atol=EXACT)
    np.testing.assert_allclose(full(*draft.inertia), inertia, atol=EXACT)
    remarks = "\n".join(draft.remarks)
    assert ("Joint yaw, revolute" in remarks) == (joint == "revolute")
    assert "platform 2 kg, gripper 0.3 kg" in remarks
    assert "were not kept: cube." in remarks


def test_mujoco_has_the_same_sum(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    path = saved("rich.xml", MJCF)(tmp_path)
    draft = read_foreign(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    body = model.body("p").id
    assert draft.mass == pytest.approx(float(model.body_subtreemass[body]))
    com = draft.home_position + draft.R_WP @ draft.center_of_mass
    np.testing.assert_allclose(com, data.subtree_com[body], atol=EXACT)
    # The body's rows of the mass matrix: moments about Po in its axes, of all that it carries.
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    c = draft.center_of_mass
    about_Po = full(*draft.inertia) + draft.mass * (c @ c * np.eye(3) - np.outer(c, c))
    first = int(model.body_dofadr[body])
    np.testing.assert_allclose(about_Po, M[first + 3 : first + 6, first + 3 : first + 6], atol=1e-9)


@pytest.mark.parametrize(
    ("joints", "motion", "axis"),
    [
        (joined("floating"), "3R3T", [0, 0, 1]),
        (joined("planar"), "2T1R", [0, 1, 0]),
        (joined("planar", "0 0 1"), "2T1R", [0, 0, 1]),
        (joined("prismatic", "0 0 1"), "1T", [0, 0, 1]),
        (slid(SLIDER, "prismatic"), "2T", [0, 1, 0]),
    ],
)
def test_the_joint_of_the_platform_is_its_motion_type(joints, motion, axis, tmp_path):
    robot = models.load_robot(str(urdf(joints)(tmp_path)))
    assert robot.motion == motion
    assert robot.home.position == pytest.approx([0, 0, 1])
    if motion != "3R3T":
        np.testing.assert_allclose(robot.motion_type().axis, axis)


def test_a_floating_joint_counts_from_its_parent(tmp_path):
    stand = '<link name="stand"/>' + joined("fixed", child="stand", name="stands")
    path = urdf(stand + joined("floating", parent="stand"))(tmp_path)
    assert read_foreign(path).home_position == pytest.approx([0, 0, 2])


@pytest.mark.parametrize("joint", ["", '<joint name="yaw" axis="0 0 1"/>'])
def test_what_the_platform_carries_hangs_on_the_ropes(joint, tmp_path):
    """Closed form: cosine of the ropes' slope, 0.95 over the length, and a quarter of 2.3 kg."""
    pytest.importorskip("mujoco")
    carried = (
        f'<body name="g" pos="0 0 -0.1">{joint}<geom type="sphere" size="0.02" mass="0.3"/></body>'
    )
    length = np.sqrt(0.9**2 + 0.9**2 + 0.95**2)
    expected = 2.3 * 9.81 / 4.0 * length / 0.95
    found = cdpr.solve_tensions(str(hung(carried)(tmp_path))).tensions
    assert found == pytest.approx([expected] * 4, rel=1e-6)


PLATE = f'<body name="plate" pos="0 0 0.1"><geom size="0.02" mass="0.5"/>{SITES}</body>'
CUBE = '<body name="q"><freejoint/><geom size="0.1"/><site name="z"/></body>'
DRAWN = SHELL.replace("/>", ' contype="0" conaffinity="0"/>')
OTHER = '<key name="b" qpos="9 9 9 1 0 0 0"/>'


def keyed(name, more=""):
    key = f'<key name="{name}" qpos="0.2 0 0.8 0 0 0 1"/>'
    return hung(after=f"<keyframe>{key}{more}</keyframe>")


def motors(gear):
    least, most = sorted([-2.0 / gear, -60.0 / gear])
    limits = f'gear="{gear}" forcerange="{least} {most}"'
    actuators = "".join(f'<motor tendon="t{k}" {limits}/>' for k in range(4))
    return hung(after=f"<actuator>{actuators}</actuator>")


@pytest.mark.parametrize(
    ("write", "key", "expected", "said"),
    [
        (hung(PLATE, sites=""), "mass", 2.5, ""),
        (hung(PLATE, sites=""), "anchor", [-0.1, -0.1, 0.15], ""),
        (hung(world=CUBE), "mass", 2.0, "no cable holds were not kept: q"),
        (hung(DRAWN.replace("/>", ' mass="0"/>'), MESH), "mass", 2.0,
         "Mesh shell was left out, there is no file nowhere.stl."),
        (hung(DRAWN, MESH), "mass", 2.0, "nowhere.stl; it counts for no mass"),
        (keyed("home", OTHER), "home_position", [0.2, 0, 0.8],
         "Not kept: mujoco/keyframe/key of b."),
        (keyed("home", OTHER), "R_WP", np.diag([-1.0, -1.0, 1.0]), ""),
        (keyed("x"), "home_position", [0.2, 0, 0.8], ""),
        (keyed("x", OTHER), "home_position", [0, 0, 1], "Not kept: mujoco/keyframe."),
        (motors(1), "limits", [2, 60], ""),
        (motors(-1), "limits", [2, 60], ""),
        (motors(-3), "limits", [2, 60], ""),
    ],
)  # fmt: skip
def test_what_is_kept_of_models_of_mujoco(write, key, expected, said, tmp_path):
    pytest.importorskip("mujoco")
    draft = read_foreign(write(tmp_path))
    cable = draft.cables[0]
    found = {"anchor": cable.anchor_point, "limits": [cable.lower, cable.upper]}
    value = found[key] if key in found else getattr(draft, key)
    np.testing.assert_allclose(value, expected, atol=EXACT)
    assert said in "\n".join(draft.remarks)
