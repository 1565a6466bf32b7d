"""Bodies that move as one are summed, by Drake's and MuJoCo's sums; joints are motion types."""

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

import cdpr_drake as cdpr
from cdpr_drake import models
from cdpr_drake.models.formats.detection import read_foreign
from tests.models.formats.foreign_files import saved
from tests.models.formats.rich_files import (
    MJCF,
    SDF,
    SITES,
    SLIDER,
    URDF,
    hung,
    joined,
    slid,
    urdf,
)
from tests.models.formats.test_refusals import MESH, SHELL

pytestmark = pytest.mark.usefixtures("in_this_process")

ROUNDING = 1e-12
"""Of a few rotations of numbers below 1."""


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
    np.testing.assert_allclose(draft.center_of_mass, com, atol=ROUNDING)
    np.testing.assert_allclose(full(*draft.inertia), inertia, atol=ROUNDING)
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
    np.testing.assert_allclose(com, data.subtree_com[body], atol=ROUNDING)
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
    np.testing.assert_allclose(value, expected, atol=ROUNDING)
    assert said in "\n".join(draft.remarks)
