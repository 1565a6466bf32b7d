"""Mechanisms out to CASPR and back: what the format holds comes back, what it does not is named."""

import json
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BallRpyJoint,
    BodyIndex,
    FixedOffsetFrame,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    ScrewJoint,
    SpatialInertia,
    UnitInertia,
    UniversalJoint,
    WeldJoint,
)

from cdpr_drake import models
from cdpr_drake.cli.app import main
from cdpr_drake.errors import RobotFileError
from cdpr_drake.formats.caspr_mechanism import initial_joints, link_names, write_mechanism
from cdpr_drake.formats.caspr_of_plant import links_of_plant
from cdpr_drake.formats.caspr_trees import CasprTree
from cdpr_drake.formats.mechanism_exchange import export_mechanism, import_mechanism
from cdpr_drake.models.mechanism_files import mechanism_names
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from tests.messages import printed
from tests.models.formats import foreign_files as files
from tests.models.formats.tree_files import Cable, Link, Model, at_start, two_link

pytestmark = pytest.mark.usefixtures("in_this_process")

SHIFTED = 1e-15
"""Of moments of 0.1 kg m^2 that were shifted to another point and back."""

CHAINED = 1e-13
"""Of poses behind eight joints in frames turned at random, and of lengths of some metres."""


def all_joints():
    """A tree of every kind of joint that CASPR has now, with branches."""
    return Model(
        [
            Link("SPATIAL_EULER_XYZ", "0.1 0.2 0.9 0.3 -0.2 0.4", name="base"),
            Link("S_EULER_XYZ", "0.2 0.5 -0.3", 1, "0.1 0 0.2", "euler"),
            Link("S_FIXED_XYZ", "0.2 0.5 -0.3", 2, "0.1 0 0.2", "fixed"),
            Link("U_XY", "0.4 -0.6", 3, "0 0.2 0.1", "xy"),
            Link("U_YZ", "0.4 -0.6", 4, "0 0.2 0.1", "yz", more='actuated="true"'),
            Link("U_XZ", "0.4 -0.6", 5, "0 0.2 0.1", "xz", more='q_min="-1 -2" q_max="3 4"'),
            Link("PLANAR_XY", "0.1 0.2 0.3", 6, "0 0 -0.2", "planar_xy"),
            Link("PLANAR_YZ", "0.1 0.2 0.3", 7, "0 0 -0.2", "planar_yz"),
            Link("PLANAR_XZ", "0.1 0.2 0.3", 8, "0 0 -0.2", "planar_xz"),
            Link("R_X", "0.7", 9, "0.3 0 0", "x"),
            Link("R_Y", "0.7", 10, "0.3 0 0", "y"),
            Link("R_Z", "0.7", 11, "0.3 0 0", "z"),
            Link("R_AXIS", "0.7", 12, "0.3 0 0", "turn", more='axis="0.2 -0.5 0.4"'),
            Link("P_AXIS", "0.7", 13, "0.3 0 0", "move", more='axis="0.2 -0.5 0.4"'),
            Link("P_X", "0.7", 14, "0.3 0 0", "one"),
            Link("P_XY", "0.7 0.1", 15, "0.3 0 0", "plane"),
            Link("P_XZ", "0.7 0.1", 16, "0.3 0 0", "upright"),
            Link("T_XYZ", "0.7 0.1 0.2", 17, "0.3 0 0", "point"),
        ],
        [
            Cable([(0, "1 1 1"), (3, "0.1 0 0"), (9, "0 0.1 0"), (18, "0 0 0.1")], name="C1",
                  kind="cable_linear_spring", properties="<K>5000.0</K><force_min>1.0</force_min>"
                  "<force_max>60.0</force_max><diameter>0.002</diameter>"),
            Cable([(17, "0.2 0.1 0"), (5, "0.1 0.1 0.1")], name="C2",
                  kind="cable_linear_spring", properties="<K>6000.0</K><force_min>1.0</force_min>"
                  "<force_max>60.0</force_max><diameter>0.002</diameter>"),
        ],
    )  # fmt: skip


def written(imported, folder: Path) -> Path:
    """The folder of a mechanism, with its files."""
    folder.mkdir()
    for name, text in imported.files().items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def again(mechanism, folder: Path):
    """A mechanism that went out to CASPR and in again, and what was named as lost."""
    files, lost = export_mechanism(mechanism)
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return import_mechanism(folder), lost


def flat(part, key=""):
    """All numbers and words of a tree by their place; axes and moments as arrays."""
    if is_dataclass(part):
        part = {field.name: getattr(part, field.name) for field in fields(part)}
    if isinstance(part, list | tuple) and any(is_dataclass(item) for item in part):
        part = dict(enumerate(part))
    if not isinstance(part, dict):
        return {key: part}
    return {k: v for name, item in part.items() for k, v in flat(item, f"{key}.{name}").items()}


@pytest.mark.parametrize("model", [two_link(), all_joints()], ids=["two links", "all joints"])
def test_out_and_in_gives_the_same_tree(model, tmp_path):
    first = import_mechanism(model.write(tmp_path))
    second, lost = again(written(first, tmp_path / "made"), tmp_path / "out")
    assert lost["mechanism"] == "names of joints, end_location of links"
    assert second.completed.remarks == ()
    assert second.tree.cable_set != first.tree.cable_set
    before, after = flat(first.tree), flat(second.tree)
    named = {".cable_set", ".remarks", ".display", ".name"}
    for key in (set(before) | set(after)) - named:
        value, found = before[key], after[key]
        if key.endswith(".end"):  # which is named as lost
            continue
        if value is None and key.endswith((".stiffness", ".diameter")):
            continue  # which are then those of the material
        if value is None or isinstance(value, str | bool):
            assert found == value, key
        else:
            rtol, atol = (1e-15, 0) if key.endswith((".stiffness", ".diameter")) else (0, SHIFTED)
            np.testing.assert_allclose(found, value, rtol=rtol, atol=atol, err_msg=key)


def in_plant(mechanism):
    plant = MultibodyPlant(0.0)
    added = add_mechanism(plant, mechanism)
    added.finalize()
    return plant, models.PlantCables(plant, added.routes())


def whole(plant, context):
    """Mass, centre of mass and inertia of all bodies in W."""
    bodies = [BodyIndex(k) for k in range(1, plant.num_bodies())]
    M = plant.CalcSpatialInertia(context, plant.world_frame(), bodies)
    return M.CopyToFullMatrix6()


def test_mujoco_reads_links_and_joints_alike(tmp_path):
    """The same file at the same coordinates: poses of all links."""
    mujoco = pytest.importorskip("mujoco")
    tree = import_mechanism(all_joints().write(tmp_path)).tree
    plant, context = at_start(tree)
    model = mujoco.MjModel.from_xml_string(write_mechanism(tree))
    data = mujoco.MjData(model)
    for name, value in initial_joints(tree).items():
        data.joint(name).qpos[:] = value
    mujoco.mj_kinematics(model, data)
    for name in link_names(tree):
        X_WB = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(name))
        there = data.body(name)
        np.testing.assert_allclose(there.xpos, X_WB.translation(), rtol=0, atol=CHAINED)
        np.testing.assert_allclose(
            there.xmat.reshape(3, 3), X_WB.rotation().matrix(), rtol=0, atol=CHAINED
        )
    assert model.nu == plant.num_actuators() == 2


@pytest.mark.parametrize("name", mechanism_names())
def test_mechanisms_that_ship_hang_the_same_in_caspr(name, tmp_path):
    mechanism = models.load_mechanism(name)
    imported, lost = again(mechanism, tmp_path / "out")
    assert {"title", "cable.linear_density", "cable.retardation_time"} <= set(lost)
    back = models.load_mechanism(written(imported, tmp_path / "made"))
    (one, cables), (two, found) = in_plant(mechanism), in_plant(back)
    a, b = one.CreateDefaultContext(), two.CreateDefaultContext()
    np.testing.assert_allclose(
        found.lengths_and_jacobian(b)[0], cables.lengths_and_jacobian(a)[0], rtol=0, atol=CHAINED
    )
    np.testing.assert_allclose(whole(two, b), whole(one, a), rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        found.routes.ends.stiffness, cables.routes.ends.stiffness, rtol=1e-15
    )
    assert all(cable.material is None for cable in back.cables)  # one material, as before
    assert one.num_velocities() == two.num_velocities()
    assert one.num_actuators() == two.num_actuators()
    # The forces that cables can balance are the same: coordinates differ, their span does not.
    ranks = [np.linalg.matrix_rank(c.length_jacobian(d)) for c, d in ((cables, a), (found, b))]
    assert ranks[0] == ranks[1]


def random_pose(rng):
    return RigidTransform(RollPitchYaw(rng.uniform(-1, 1, 3)), rng.uniform(-0.3, 0.3, 3))


def test_joints_of_drake_in_any_frames_are_links_of_caspr(tmp_path):
    """Poses at positions of the plant, and mass, are those of the links that it becomes."""
    rng = np.random.default_rng(7)
    plant = MultibodyPlant(0.0)
    instance = plant.AddModelInstance("zoo")
    inertia = SpatialInertia(1.5, [0.1, -0.05, 0.2], UnitInertia(0.2, 0.25, 0.3))
    frames, bodies = [], [plant.world_body()]

    def fixed(body, X):
        frames.append(X)
        return plant.AddFrame(FixedOffsetFrame(f"f{len(frames)}", body, X))

    quarter = RigidTransform(RollPitchYaw(np.pi / 2, 0, np.pi / 2), np.array([0.1, 0.2, -0.1]))
    level = RigidTransform(np.array([0.2, 0.0, 0.1]))
    turned = [random_pose(rng) for _ in range(12)]
    kinds = [
        (lambda F, M: WeldJoint("weld", F, M, random_pose(rng)), turned[0], turned[1]),
        (lambda F, M: RevoluteJoint("revolute", F, M, [0.3, 0.4, 0.5]), turned[2], turned[3]),
        (lambda F, M: PrismaticJoint("prismatic", F, M, [0.3, 0.4, 0.5]), turned[4], turned[5]),
        (lambda F, M: BallRpyJoint("ball", F, M), turned[6], turned[7]),
        (lambda F, M: WeldJoint("weld2", F, M, random_pose(rng)), turned[8], turned[9]),
        (lambda F, M: UniversalJoint("universal", F, M), turned[10], turned[11]),
        (lambda F, M: PlanarJoint("planar", F, M), quarter, quarter),
        (lambda F, M: BallRpyJoint("ball2", F, M), level, level),
    ]
    for k, (make, X_PF, X_BM) in enumerate(kinds):
        body = plant.AddRigidBody(f"b{k}", instance, inertia)
        plant.AddJoint(make(fixed(bodies[-1], X_PF), fixed(body, X_BM)))
        bodies.append(body)
    free = plant.AddRigidBody("free", instance, inertia)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    q = rng.uniform(-0.8, 0.8, plant.num_positions())
    q[plant.GetJointByName("free").position_start() :][:4] = [0.5, 0.5, -0.5, 0.5]
    plant.SetPositions(context, q)
    made = links_of_plant(plant, context, {int(free.index())})
    tree = CasprTree(name="zoo", links=tuple(made.links), cables=(), cable_set="none")
    other, there = at_start(tree)
    names = link_names(tree)
    for body in [*bodies[1:], free]:
        index = int(body.index())
        number = made.host[index]
        X_WL = RigidTransform()
        if number:
            X_WL = other.EvalBodyPoseInWorld(there, other.GetBodyByName(names[number - 1]))
        X = (X_WL @ made.X_LB[index]).GetAsMatrix34()
        X_WB = plant.EvalBodyPoseInWorld(context, body).GetAsMatrix34()
        np.testing.assert_allclose(X, X_WB, rtol=0, atol=CHAINED)
    moving = [body.index() for body in [*bodies[2:], free]]  # b0 is fixed to the world
    M = plant.CalcSpatialInertia(context, plant.world_frame(), moving).CopyToFullMatrix6()
    np.testing.assert_allclose(whole(other, there), M, rtol=0, atol=1e-12)
    assert plant.num_velocities() == other.num_velocities()
    kinds = [link.joint.kind for link in tree.links]
    assert kinds.count("SPATIAL_EULER_XYZ") == 1
    # What has frames of its own turns about axes of its own.
    assert kinds[:2] == ["R_AXIS", "P_AXIS"]
    assert kinds[2] == "S_EULER_XYZ"
    assert kinds[3:5] == ["R_AXIS", "R_AXIS"]  # a universal joint, with a massless link


def test_frames_along_axes_give_the_joints_of_caspr():
    plant = MultibodyPlant(0.0)
    instance = plant.AddModelInstance("axes")
    inertia = SpatialInertia(1.5, [0.1, -0.05, 0.2], UnitInertia(0.2, 0.25, 0.3))
    one, two, three = (plant.AddRigidBody(n, instance, inertia) for n in ("one", "two", "three"))
    X = RigidTransform(RollPitchYaw(np.pi / 2, 0, 0), np.zeros(3))  # y of F is z of W, z is -y
    plant.AddJoint(PlanarJoint("planar", plant.world_frame(), one.body_frame()))
    plant.AddJoint(RevoluteJoint("back", one.body_frame(), two.body_frame(), [0, 0, -1], -1, 2))
    F = plant.AddFrame(FixedOffsetFrame("F", two, X))
    plant.AddJoint(PlanarJoint("upright", F, three.body_frame()))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7])
    made = links_of_plant(plant, context, set())
    assert [link.joint.kind for link in made.links] == ["PLANAR_XY", "R_Z", "PLANAR_XZ"]
    first, second, third = (link.joint for link in made.links)
    np.testing.assert_allclose(first.initial, [0.1, 0.2, 0.3])
    np.testing.assert_allclose(second.initial, [-0.4])  # about z instead of -z
    assert (second.lower, second.upper) == ([-2.0], [1.0])
    np.testing.assert_allclose(third.initial, [0.5, 0.6, -0.7])


def test_what_caspr_cannot_hold_is_refused_or_named(tmp_path):
    folder = written(import_mechanism(two_link().write(tmp_path)), tmp_path / "made")
    with pytest.raises(RobotFileError, match=r"format: found sdf; accepted .*: caspr"):
        export_mechanism(folder, "sdf")
    text = (folder / "mechanism.yaml").read_text(encoding="utf-8")
    tilted = folder / "tilted.yaml"
    tilted.write_text(text + "gravity_direction: [0.1, 0, -1]\n", encoding="utf-8")
    with pytest.raises(RobotFileError, match=r"gravity_direction: found .* along -z"):
        export_mechanism(tilted)
    moon = folder / "moon.yaml"
    moon.write_text(
        text + "gravity: 1.62\nanchor_pulley: {radius: 0.02}\npulley: {radius: 0.01}\n",
        encoding="utf-8",
    )
    _, lost = export_mechanism(moon)
    assert lost["gravity"] == "caspr has 9.81 m/s^2"
    assert "cables[].anchor_pulley_radius" in lost
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody(
        "nut", plant.AddModelInstance("m"), SpatialInertia.SolidSphereWithMass(1, 1)
    )
    plant.AddJoint(ScrewJoint("screw", plant.world_frame(), body.body_frame(), [0, 0, 1], 0.1, 0))
    plant.Finalize()
    with pytest.raises(RobotFileError, match="joint screw: found a ScrewJoint; accepted by CASPR"):
        links_of_plant(plant, plant.CreateDefaultContext(), set())


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Exit code, stdout and stderr of a command in the test's folder."""
    monkeypatch.chdir(tmp_path)

    def ran(*arguments):
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        return ended.value.code, *printed(capsys)

    return ran


def names_in(folder):
    return sorted(file.name for file in Path(folder).iterdir())


def test_the_commands_make_a_folder_and_files_of_caspr(tmp_path, run):
    code, out, _ = run("import", two_link().write(tmp_path), "--name", "arm")
    assert code == 0
    assert out.startswith("arm: 2 links, 2 coordinates, 2 cables, from CASPR XML\n")
    assert names_in("arm") == ["README.md", "arm.xml", "mechanism.yaml"]
    assert "Imported from `toy_bodies.xml`" in Path("arm/README.md").read_text(encoding="utf-8")
    code, out, err = run("export", "arm", "--format", "caspr", "--out", "back")
    assert code == 0
    assert "not written: mechanism (names of joints, end_location of links)" in err
    assert names_in("back") == ["arm_bodies.xml", "arm_cables.xml"]
    code, out, _ = run("import", "back", "--name", "arm", "--out", "third", "--json")
    told = json.loads(out)
    assert (told["mechanism"], told["links"], told["cables"]) == ("arm", 2, 2)
    assert told["files"][1] == str(Path("third/arm.xml"))
    code, _, err = run("export", "arm", "--format", "urdf")
    assert code == 2
    assert len(err.strip().splitlines()) == 1


def test_only_inertia_of_mechanisms_is_repaired_and_nothing_is_written_else(tmp_path, run):
    code, _, err = run("import", files.caspr(tmp_path), "--repair-inertia")
    assert code == 2
    assert "--repair-inertia: found with" in err
    assert not Path("toy").exists()
    model = two_link()
    model.links[1].inertia = "0.01 0.01 0.1 0 0 0"
    path = model.write(tmp_path)
    code, _, err = run("import", path, "--out", "made")
    assert code == 2
    assert len(err.strip().splitlines()) == 1
    assert not Path("made").exists()
    code, out, _ = run("import", path, "--out", "made", "--repair-inertia")
    assert code == 0
    assert "note: link 2: principal moments 0.01, 0.01, 0.1 were changed to" in out
