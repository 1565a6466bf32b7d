"""Platforms and frames that are no boxes: inertia where it is asked for, scene, clearances."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from pydrake.geometry import Cylinder, Mesh, Role, SceneGraph, Sphere
from pydrake.multibody.plant import MultibodyPlant

from cdpr_drake.analyses.reporting.provenance import write_run_inputs
from cdpr_drake.analyses.workspaces.workspace_question import interference_bodies
from cdpr_drake.errors import RobotFileError
from cdpr_drake.models.robot_exports import export_omissions
from cdpr_drake.models.robot_in_plant import add_robot, platform_inertia
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.scene import add_frame
from cdpr_drake.systems.diagrams.load import load_scenario
from tests.models.robots import content_of, robot_of

SIZE, MASS = np.array([0.2, 0.2, 0.2]), 3.0

EXACT = 1e-12


def content_with(shape=None, inertia_of=None, beams=None):
    content = content_of()
    content["platform"] = {"mass": MASS, "size": SIZE.tolist()}
    if shape is not None:
        content["platform"]["shape"] = shape
    if inertia_of is not None:
        content["platform"]["inertia_of"] = inertia_of
    if beams is not None:
        content["frame"]["beams"] = beams
    return content


def moments(robot):
    """About the centre of mass, axes of P [kg m^2]."""
    return platform_inertia(robot).Shift(robot.center_of_mass()).CalcRotationalInertia()


def crate(folder, edges=SIZE):
    """A closed box of triangles as an OBJ file, its origin in its middle."""
    x, y, z = np.asarray(edges) / 2.0
    corners = [(a * x, b * y, c * z) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]
    quads = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = [f"v {a!r} {b!r} {c!r}" for a, b, c in np.array(corners).tolist()]
    lines += [f"f {a} {b} {c}\nf {a} {c} {d}" for a, b, c, d in quads]
    (folder / "crate.obj").write_text("\n".join(lines) + "\n")


def loaded(folder, content):
    path = folder / "robot.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return load_robot(str(path))


def test_a_shape_alone_changes_no_inertia():
    box = robot_of(content_with())
    ball = robot_of(content_with({"kind": "sphere", "radius": 0.1}))
    np.testing.assert_array_equal(
        platform_inertia(ball).CopyToFullMatrix6(), platform_inertia(box).CopyToFullMatrix6()
    )


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ({"kind": "sphere", "radius": 0.1}, [0.4 * 0.01] * 3),
        (
            {"kind": "cylinder", "radius": 0.08, "height": 0.2},
            [(3 * 0.0064 + 0.04) / 12, (3 * 0.0064 + 0.04) / 12, 0.0032],
        ),
        (
            {"kind": "cylinder", "radius": 0.08, "height": 0.2, "angles_deg": [0.0, 90.0, 0.0]},
            [0.0032, (3 * 0.0064 + 0.04) / 12, (3 * 0.0064 + 0.04) / 12],
        ),
        ({"kind": "box", "size": [0.1, 0.2, 0.1]}, [0.05 / 12, 0.02 / 12, 0.05 / 12]),
    ],
)
def test_a_homogeneous_shape_has_its_inertia_where_it_is_asked_for(shape, expected):
    robot = robot_of(content_with(shape, "shape"))
    np.testing.assert_allclose(moments(robot).get_moments(), MASS * np.array(expected), rtol=EXACT)
    np.testing.assert_allclose(moments(robot).get_products(), 0.0, atol=1e-15)
    assert platform_inertia(robot).get_mass() == pytest.approx(MASS, rel=EXACT)


def test_a_shape_off_the_middle_moves_the_centre_of_mass():
    shape = {"kind": "sphere", "radius": 0.05, "position": [0.03, -0.02, 0.06]}
    robot = robot_of(content_with(shape, "shape"))
    np.testing.assert_allclose(robot.center_of_mass(), [0.03, -0.02, 0.06], atol=EXACT)
    np.testing.assert_allclose(moments(robot).get_moments(), 0.4 * MASS * 0.0025, rtol=EXACT)
    content = content_with(shape, "shape")
    content["platform"]["center_of_mass"] = [0.0, 0.0, 0.1]
    given = robot_of(content)
    np.testing.assert_allclose(platform_inertia(given).get_com(), [0.0, 0.0, 0.1], atol=EXACT)
    np.testing.assert_allclose(moments(given).get_moments(), 0.4 * MASS * 0.0025, rtol=EXACT)


def test_a_mesh_has_the_inertia_of_what_it_encloses(tmp_path):
    crate(tmp_path, [0.1, 0.2, 0.15])
    robot = loaded(tmp_path, content_with({"kind": "mesh", "file": "crate.obj"}, "shape"))
    expected = MASS / 12.0 * np.array([0.0625, 0.0325, 0.05])
    np.testing.assert_allclose(moments(robot).get_moments(), expected, rtol=1e-9)


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "mesh"])
def test_the_scene_shows_the_shape(kind, tmp_path):
    crate(tmp_path)
    robot = loaded(
        tmp_path,
        content_with(
            {"kind": kind, "radius": 0.1, "height": 0.2, "file": "crate.obj"},
            beams=[{"start": [-0.5, 0, 0], "end": [-0.5, 0, 1]}] * 3,
        ),
    )
    scene, plant = SceneGraph(), MultibodyPlant(0.0)
    plant.RegisterAsSourceForSceneGraph(scene)
    in_plant = add_robot(plant, robot)
    add_frame(plant, robot)
    plant.Finalize()
    inspector = scene.model_inspector()
    frame = plant.GetBodyFrameIdOrThrow(in_plant.body_index)
    (found,) = inspector.GetGeometries(frame, Role.kIllustration)
    shape = inspector.GetShape(found)
    assert isinstance(shape, {"sphere": Sphere, "cylinder": Cylinder, "mesh": Mesh}[kind])
    assert len(inspector.GetGeometries(inspector.world_frame_id(), Role.kIllustration)) == 3


def test_clearances_reckon_with_the_frames_own_beams():
    ends = np.array([[-0.6, -0.6, 0.0], [0.6, 0.6, 1.2]])
    beams = [{"start": ends[0].tolist(), "end": ends[1].tolist(), "width": 0.02}]
    around = interference_bodies(robot_of(content_with(beams=beams)))
    (row,) = around.fixtures
    R, middle, half = row[:9].reshape(3, 3), row[9:12], row[12:]
    np.testing.assert_allclose(middle, ends.mean(axis=0), atol=EXACT)
    np.testing.assert_allclose(half, [0.01, 0.01, np.linalg.norm(ends[1] - ends[0]) / 2])
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=EXACT)
    np.testing.assert_allclose(middle + half[2] * R[:, 2], ends[1], atol=EXACT)
    assert len(interference_bodies(robot_of(content_with())).fixtures) == 12


def test_a_mesh_that_encloses_nothing_has_no_inertia(tmp_path):
    crate(tmp_path)
    path = tmp_path / "crate.obj"
    shape = {"kind": "mesh", "file": "crate.obj"}
    path.write_text("\n".join(path.read_text().splitlines()[:-1]) + "\n")  # a triangle less
    with pytest.raises(RobotFileError, match=r"crate\.obj: found no volume that its triangles"):
        loaded(tmp_path, content_with(shape, "shape"))
    assert loaded(tmp_path, content_with(shape)).platform.inertia_of == "box"


def test_an_export_says_that_it_writes_the_box():
    robot = robot_of(content_with({"kind": "sphere", "radius": 0.1}))
    lost = export_omissions(robot, "urdf")
    for key in ("kind", "radius"):
        assert lost[f"platform.shape.{key}"] == "the platform was written as its box"
    assert "no place" in export_omissions(robot, "wcrfx")["platform.shape.kind"]


def test_the_folder_of_a_run_has_all_of_the_robot(tmp_path):
    """Whatever a robot file can say of hardware, written as it was run and read elsewhere."""
    there, kept = tmp_path / "there", tmp_path / "kept"
    there.mkdir()
    kept.mkdir()
    crate(there)
    lines = (there / "crate.obj").read_text()
    (there / "crate.obj").write_text("mtllib crate.mtl\n" + lines)
    (there / "crate.mtl").write_text("newmtl grey\nKd 0.5 0.5 0.5\n")
    beams = [{"start": [-0.5, 0, 0], "end": [-0.5, 0, 1]}]
    content = content_with({"kind": "mesh", "file": "crate.obj"}, "shape", beams)
    content["cables"][0] |= {"material": {"diameter": 0.002}, "winch": "both"}
    content["cables"][1] |= {"material": {"diameter": 0.002}, "winch": "both"}
    content["cables"][2] |= {"anchor_pulley_radius": 0.01, "anchor_swivel_axis": [1.0, 0.0, 0.0]}
    content["platform_pulley"] = {"radius": 0.005}
    robot = loaded(there, content)
    write_run_inputs(kept, load_scenario("acrobot_pbvs"), robot)
    inertia = platform_inertia(robot).CopyToFullMatrix6()
    for file in there.iterdir():
        file.unlink()
    again = load_robot(str(kept / "robot.yaml"))
    assert (kept / "crate.mtl").is_file()
    ours, theirs = robot.cable_set(), again.cable_set()
    np.testing.assert_array_equal(theirs.packed(), ours.packed())
    assert again.winch_groups() == robot.winch_groups()
    np.testing.assert_array_equal(platform_inertia(again).CopyToFullMatrix6(), inertia)
    np.testing.assert_array_equal(again.frame.beams[0].end, robot.frame.beams[0].end)
