"""Bodies that move as one are summed; the joint of the platform is its motion type, or refused."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

import cdpr_drake as cdpr
from cdpr_drake import models
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.formats.detection import read_foreign
from tests.models.formats.rich_files import CORNERS, MJCF, SDF, URDF

ROUNDING = 1e-12
"""Of a few rotations of numbers below 1."""


def rpy(roll, pitch, yaw):
    """Rz Ry Rx, by hand."""
    (a, b, c), (s, t, u) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    X = np.array([[1, 0, 0], [0, a, -s], [0, s, a]])
    Y = np.array([[b, 0, t], [0, 1, 0], [-t, 0, b]])
    Z = np.array([[c, -u, 0], [u, c, 0], [0, 0, 1]])
    return Z @ Y @ X


def full(xx, yy, zz, xy, xz, yz):
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def summed(parts):
    """Mass, centre and inertia about it of parts (m, p, R, I about their centres), in one frame."""
    mass = sum(m for m, *_ in parts)
    com = sum(m * p for m, p, *_ in parts) / mass
    inertia = np.zeros((3, 3))
    for m, p, R, I in parts:  # noqa: E741
        d = p - com
        inertia += R @ I @ R.T + m * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, com, inertia


R_PG = rpy(0.4, 0.5, 0.6)
PLATFORM = (2.0, np.array([0.01, 0.02, 0.03]), rpy(0.1, 0.2, 0.3),
            full(0.01, 0.02, 0.025, 0.001, 0.0015, 0.0005))  # fmt: skip
GRIPPER = (0.3, np.array([0.05, 0.06, -0.1]) + R_PG @ [0.1, 0.2, 0.3], R_PG @ rpy(0.3, 0.2, 0.1),
           full(0.001, 0.002, 0.0025, 0.0001, 0.0002, 0.0003))  # fmt: skip
"""The two links of the rich files, in P."""


@pytest.mark.parametrize("joint", ["fixed", "revolute"])
@pytest.mark.parametrize(("name", "text"), [("rich.urdf", URDF), ("rich.sdf", SDF)])
def test_links_of_a_platform_are_summed(name, text, joint, tmp_path):
    path = tmp_path / name
    path.write_text(text.replace('name="yaw" type="revolute"', f'name="yaw" type="{joint}"'))
    draft = read_foreign(path)
    mass, com, inertia = summed([PLATFORM, GRIPPER])
    assert draft.mass == pytest.approx(mass)
    np.testing.assert_allclose(draft.center_of_mass, com, atol=ROUNDING)
    np.testing.assert_allclose(full(*draft.inertia), inertia, atol=ROUNDING)
    assert any("Joint yaw, revolute" in words for words in draft.remarks) == (joint == "revolute")
    assert any("platform 2 kg, gripper 0.3 kg" in words for words in draft.remarks)
    assert any("were not kept: cube." in words for words in draft.remarks)


def test_drake_has_the_same_sum(tmp_path):
    path = tmp_path / "rich.urdf"
    path.write_text(URDF.replace('name="hangs" type="floating"', 'name="hangs" type="fixed"'))
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    bodies = [plant.GetBodyByName(name) for name in ("platform", "gripper")]
    context = plant.CreateDefaultContext()
    indices = [body.index() for body in bodies]
    theirs = plant.CalcSpatialInertia(context, bodies[0].body_frame(), indices)
    mass, com, inertia = summed([PLATFORM, GRIPPER])
    assert theirs.get_mass() == pytest.approx(mass)
    np.testing.assert_allclose(theirs.get_com(), com, atol=ROUNDING)
    about = theirs.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()
    np.testing.assert_allclose(about, inertia, atol=ROUNDING)


def test_mujoco_has_the_same_sum(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "rich.xml"
    path.write_text(MJCF)
    draft = read_foreign(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    body = model.body("p").id
    assert draft.mass == pytest.approx(float(model.body_subtreemass[body]))
    com = draft.home_position + draft.R_WP @ draft.center_of_mass
    np.testing.assert_allclose(com, data.subtree_com[body], atol=ROUNDING)
    # The body's rows of the mass matrix: moments about Po in its axes, of all that it carries.
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    c = draft.center_of_mass
    about_Po = full(*draft.inertia) + draft.mass * (c @ c * np.eye(3) - np.outer(c, c))
    first = int(model.body_dofadr[body])
    np.testing.assert_allclose(about_Po, M[first + 3 : first + 6, first + 3 : first + 6], atol=1e-9)


HEAD = """<robot name="r"><link name="world"/><link name="platform"><inertial><mass value="2"/>
<inertia ixx="0.01" iyy="0.03" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>{joints}"""

POINTS = "".join(
    f'<link name="exit_C{k}"/><joint name="e{k}" type="fixed"><parent link="world"/>'
    f'<child link="exit_C{k}"/><origin xyz="{x} {y} 2"/></joint><link name="anchor_C{k}"/>'
    f'<joint name="a{k}" type="fixed"><parent link="platform"/><child link="anchor_C{k}"/>'
    f'<origin xyz="{0.1 * x} {0.1 * y} 0.05"/></joint>'
    for k, (x, y) in enumerate(CORNERS)
)


def joined(kind, axis="0 1 0", parent="world", child="platform", name="moves", more=""):
    limits = '<limit effort="1" velocity="1" lower="-1" upper="1"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 {0 if name == "second" else 1}"/><axis xyz="{axis}"/>'
        f"{limits if kind in ('revolute', 'prismatic') else ''}{more}</joint>"
    )


def urdf(folder, joints):
    path = folder / "r.urdf"
    path.write_text(HEAD.format(joints=joints) + POINTS + "</robot>")
    return path


@pytest.mark.parametrize(
    ("joints", "motion", "axis"),
    [
        (joined("floating"), "3R3T", None),
        (joined("planar"), "2T1R", [0, 1, 0]),
        (joined("planar", "0 0 1"), "2T1R", [0, 0, 1]),
        (joined("prismatic", "0 0 1"), "1T", [0, 0, 1]),
        ('<link name="slider"/>' + joined("prismatic", "1 0 0", child="slider")
         + joined("prismatic", "0 0 1", parent="slider", name="second"), "2T", [0, 1, 0]),
        ('<link name="slider"/>' + joined("prismatic", "1 0 0", child="slider")
         + joined("revolute", "0 0 1", parent="slider", name="second"), None, "joint second"),
        (joined("revolute"), None, "revolute joint moves"),
        (joined("continuous"), None, "revolute joint moves"),
        (joined("fixed"), None, "fixed joint moves"),
    ],
)  # fmt: skip
def test_the_joint_of_the_platform_is_its_motion_type(joints, motion, axis, tmp_path):
    path = urdf(tmp_path, joints)
    if motion is None:
        with pytest.raises(RobotFileError) as caught:
            models.load_robot(str(path))
        assert axis in str(caught.value)
        assert "\n" not in str(caught.value)
        return
    robot = models.load_robot(str(path))
    assert robot.motion == motion
    assert robot.home.position == pytest.approx([0, 0, 1])
    if axis is not None:
        np.testing.assert_allclose(robot.motion_type().axis, axis)


def test_a_body_of_its_own_weight_between_two_slides_is_refused(tmp_path):
    heavy = """<link name="slider"><inertial><mass value="3"/><inertia ixx="0.01" iyy="0.03"
    izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
    joints = heavy + joined("prismatic", "1 0 0", child="slider")
    path = urdf(tmp_path, joints + joined("prismatic", "0 0 1", parent="slider", name="second"))
    with pytest.raises(RobotFileError, match="link slider: found 3 kg between the joints"):
        read_foreign(path)


@pytest.mark.parametrize(("end", "joint"), [("exit_C0", "e0"), ("anchor_C0", "a0")])
def test_points_on_bodies_that_joints_move_are_refused(end, joint, tmp_path):
    path = urdf(tmp_path, joined("floating"))
    text = path.read_text().replace(
        f'name="{joint}" type="fixed"', f'name="{joint}" type="continuous"'
    )
    path.write_text(text)
    with pytest.raises(RobotFileError, match=f"{end}.* revolute joint {joint}.* mechanism file"):
        read_foreign(path)


def test_a_floating_joint_counts_from_its_parent(tmp_path):
    stand = '<link name="stand"/>' + joined("fixed", child="stand", name="stands")
    path = urdf(tmp_path, stand + joined("floating", parent="stand"))
    assert read_foreign(path).home_position == pytest.approx([0, 0, 2])


def test_a_ball_joint_to_the_world_is_no_free_body(tmp_path):
    path = tmp_path / "rich.sdf"
    ball = '<joint name="holds" type="ball"><parent>gantry</parent><child>platform</child></joint>'
    path.write_text(SDF.replace('<plugin name="drive"', f'{ball}<plugin name="drive"'))
    with pytest.raises(RobotFileError, match="ball_rpy joint holds"):
        read_foreign(path)


def hung(free="", inner="", after="", world=""):
    """MJCF of a plate on four ropes, with more in its body, behind it or in the world."""
    exits = "".join(f'<site name="w{k}" pos="{x} {y} 2"/>' for k, (x, y) in enumerate(CORNERS))
    sites = "".join(
        f'<site name="a{k}" pos="{0.1 * x} {0.1 * y} 0.05"/>' for k, (x, y) in enumerate(CORNERS)
    )
    ropes = "".join(
        f'<spatial name="t{k}"><site site="w{k}"/><site site="a{k}"/></spatial>' for k in range(4)
    )
    return (
        f'<mujoco><worldbody>{exits}{world}<body name="p" pos="0 0 1">{free or "<freejoint/>"}'
        f'<geom type="box" size="0.1 0.1 0.05" mass="2"/>{inner or sites}</body></worldbody>'
        f"<tendon>{ropes}</tendon>{after}</mujoco>"
    ), sites


def mjcf(folder, **more):
    path = folder / "hung.xml"
    path.write_text(hung(**more)[0])
    return path


@pytest.mark.parametrize("joint", ["", '<joint name="yaw" axis="0 0 1"/>'])
def test_what_the_platform_carries_hangs_on_the_ropes(joint, tmp_path):
    """Closed form: cosine of the ropes' slope, 0.95 over the length, and a quarter of 2.3 kg."""
    pytest.importorskip("mujoco")
    carried = (
        f'<body name="g" pos="0 0 -0.1">{joint}<geom type="sphere" size="0.02" mass="0.3"/></body>'
    )
    path = mjcf(tmp_path, inner=hung()[1] + carried)
    length = np.sqrt(0.9**2 + 0.9**2 + 0.95**2)
    expected = 2.3 * 9.81 / 4.0 * length / 0.95
    assert cdpr.solve_tensions(str(path)).tensions == pytest.approx([expected] * 4, rel=1e-6)


def test_sites_may_be_on_bodies_that_are_fixed_to_the_free_one(tmp_path):
    pytest.importorskip("mujoco")
    plate = f'<body name="plate" pos="0 0 0.1"><geom size="0.02" mass="0.5"/>{hung()[1]}</body>'
    draft = read_foreign(mjcf(tmp_path, inner=plate))
    assert draft.mass == pytest.approx(2.5)
    assert draft.cables[0].anchor_point == pytest.approx([-0.1, -0.1, 0.15])


def test_a_keyframe_has_the_home_pose(tmp_path):
    pytest.importorskip("mujoco")
    keys = '<keyframe><key name="{}" qpos="0.2 0 0.8 0 0 0 1"/>{}</keyframe>'
    other = '<key name="b" qpos="9 9 9 1 0 0 0"/>'
    draft = read_foreign(mjcf(tmp_path, after=keys.format("home", other)))
    assert draft.home_position == pytest.approx([0.2, 0, 0.8])
    np.testing.assert_allclose(draft.R_WP, np.diag([-1.0, -1.0, 1.0]), atol=ROUNDING)
    assert "Not kept: mujoco/keyframe/key of b." in draft.remarks
    assert read_foreign(mjcf(tmp_path, after=keys.format("x", ""))).home_position[0] == 0.2
    two = read_foreign(mjcf(tmp_path, after=keys.format("x", other)))
    assert two.home_position == pytest.approx([0, 0, 1])
    assert "Not kept: mujoco/keyframe." in two.remarks


MESH = '<asset><mesh name="shell" file="nowhere.stl"/></asset>'


@pytest.mark.parametrize(
    ("geom", "words"),
    [
        ('<geom type="mesh" mesh="shell" contype="0" conaffinity="0" mass="0"/>',
         "Mesh shell was left out, there is no file nowhere.stl."),
        ('<geom type="mesh" mesh="shell" contype="0" conaffinity="0"/>',
         "nowhere.stl; it counts for no mass"),
        ('<geom type="mesh" mesh="shell"/>', None),
        ('<geom type="mesh" mesh="shell" contype="0" conaffinity="0" mass="1"/>', None),
    ],
)  # fmt: skip
def test_a_mesh_that_is_only_drawn_may_be_missing(geom, words, tmp_path):
    pytest.importorskip("mujoco")
    path = mjcf(tmp_path, inner=hung()[1] + geom, after=MESH)
    if words is None:
        with pytest.raises(RobotFileError, match=r"mesh shell: found no file nowhere.stl"):
            read_foreign(path)
        return
    draft = read_foreign(path)
    assert draft.mass == pytest.approx(2.0)
    assert any(words in remark for remark in draft.remarks)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('<spatial name="t0"><site site="w0"/>',
         '<spatial name="t0"><pulley divisor="2"/><site site="w0"/>', "a pulley of divisor 2"),
        ('<site site="w0"/>', '<site site="w0"/><geom geom="roll"/>', "a wrap round the geom roll"),
        ("<freejoint/>", '<joint name="pin" axis="0 0 1"/>', "hinge joint pin.*mechanism file"),
        ("<freejoint/>", '<joint name="pin" type="ball"/>', "ball joint pin.*mechanism file"),
        ("<freejoint/>", "", "body p without a joint"),
        ('<site name="w0" pos="-1 -1 2"/>',
         '<body name="car" pos="-1 -1 2"><joint name="rides" type="slide"/><geom size="0.1"/>'
         '<site name="w0"/></body>', r"car \(slide joint rides\).*mechanism file"),
        ('<body name="p" pos="0 0 1">',
         '<body name="q"><freejoint/><geom size="0.1"/><site name="z"/></body>'
         '<body name="p" pos="0 0 1">', None),
        ('site="a3"', 'site="z"', r"p \(free joint 0\), q \(free joint pin\).*mechanism file"),
    ],
)  # fmt: skip
def test_what_a_tendon_or_a_joint_cannot_be_is_named(old, new, words, tmp_path):
    pytest.importorskip("mujoco")
    roll = '<geom name="roll" type="cylinder" size="0.05 0.1" pos="0 0 3"/>'
    free = ('<body name="q"><joint name="pin" type="free"/><geom size="1"/><site name="z"/></body>'
            if 'site="z"' in new else "")  # fmt: skip
    path = tmp_path / "hung.xml"
    text = hung(world=roll)[0]
    assert old in text
    path.write_text(text.replace(old, new, 1).replace("</worldbody>", f"{free}</worldbody>"))
    if words is None:
        assert any("no cable holds were not kept: q" in line for line in read_foreign(path).remarks)
        return
    with pytest.raises(RobotFileError, match=words) as caught:
        read_foreign(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("gear", [1, -1, -3])
def test_tension_limits_count_the_gear(gear, tmp_path):
    pytest.importorskip("mujoco")
    least, most = sorted([-2.0 / gear, -60.0 / gear])
    motors = "".join(
        f'<motor tendon="t{k}" gear="{gear}" forcerange="{least} {most}"/>' for k in range(4)
    )
    draft = read_foreign(mjcf(tmp_path, after=f"<actuator>{motors}</actuator>"))
    assert draft.cables[0].lower == pytest.approx(2.0)
    assert draft.cables[0].upper == pytest.approx(60.0)
