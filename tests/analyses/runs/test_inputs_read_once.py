"""A result is of files as they were at first; `test_seeds` has one that is edited meanwhile."""

import hashlib
import json
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame.jobs import with_inputs
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.models.mechanism_loader import load_mechanism
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.schema.input_files import (
    InputFiles,
    SentInputs,
    input_path,
    inputs_held,
    inputs_read_once,
)
from cdpr_drake.systems.worlds.model_files import mesh_parts
from tests.models.formats.foreign_files import caspr
from tests.models.test_drake_parsing import MECHANISM

SHORT = ["camera.kind=projected", "duration=0.1"]

OBJ = "v -0.05 -0.05 -0.04\nv {x} 0 0\nv 0 0.1 0\nv 0 0 0.04\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def write_robot(file, mass="1.5"):
    text = robot_file("acrobot_small").read_text()
    assert "  mass: 1.5\n" in text
    file.write_text(text.replace("  mass: 1.5\n", f"  mass: {mass}\n"))
    return file


def test_a_worker_with_another_file_there_computes_with_ours(tmp_path):
    file = write_robot(tmp_path / "mine.yaml")
    with inputs_read_once():
        load_robot(file)
        sent = pickle.dumps(with_inputs(load_robot))
    write_robot(file, "1.95")
    assert pickle.loads(sent)(file).platform.mass == 1.5
    file.unlink()
    assert pickle.loads(sent)(str(file)).platform.mass == 1.5
    assert inputs_held() is None


def corners(parts):
    hull = parts[0].shape.GetConvexHull()
    return np.array([hull.vertex(k) for k in range(hull.num_vertices())])


def test_meshes_cameras_and_other_tools_files_are_read_once(tmp_path):
    mesh, camera = tmp_path / "stone.obj", tmp_path / "lens.yaml"
    mesh.write_text(OBJ.format(x=0.1))
    shutil.copy(Path(cdpr.__file__).parent / "models" / "cameras" / "astra.yaml", camera)
    folder = tmp_path / "toy"
    folder.mkdir()
    caspr(folder)

    def read():
        return (
            corners(mesh_parts(str(mesh), 1.0, [1, 1, 1, 1])).max(),
            load_camera(str(camera)).width,
            load_robot(folder).platform.mass,
            load_robot(folder / "toy_bodies.xml").platform.mass,
        )

    with inputs_read_once():
        first = read()
        sent = pickle.dumps(inputs_held())
        mesh.write_text(OBJ.format(x=0.9))
        camera.write_text(camera.read_text().replace("width: ", "width: 1", 1))
        shutil.rmtree(folder)
        assert read() == first
    with inputs_read_once(pickle.loads(sent)):
        assert read() == first
    assert corners(mesh_parts(str(mesh), 1.0, [1, 1, 1, 1])).max() == 0.9


def test_platform_meshes_are_those_that_were_read(tmp_path):
    mesh = tmp_path / "body.obj"
    mesh.write_text(OBJ.format(x=0.04))
    shape = "shape: {kind: mesh, file: body.obj, scale: 0.5, position: [0, 0, 0.035]}"
    file = write_robot(tmp_path / "mine.yaml", f"1.5\n  {shape}")
    with inputs_read_once():
        shape = load_robot(file).platform.shape
        first = shape.extent(np.zeros(3))[1]
        mesh.write_text(OBJ.format(x=0.02))
        again = load_robot(file).platform.shape.extent(np.zeros(3))[1]
        assert shape.file == str(mesh)
    np.testing.assert_array_equal(first, again)
    assert load_robot(file).platform.shape.extent(np.zeros(3))[1][0] < first[0]


def test_results_have_the_hash_of_what_was_read(tmp_path, monkeypatch):
    monkeypatch.setattr("cdpr_drake.analyses.runs.run.figure_writers", lambda *_: {})
    file = write_robot(tmp_path / "mine.yaml")
    wanted = hashlib.sha256(file.read_bytes()).hexdigest()
    cdpr.simulate("acrobot_pbvs", [*SHORT, f"robot={file}"], folder=tmp_path / "run")
    told = json.loads((tmp_path / "run" / "inputs.json").read_text())
    assert told == {"mine.yaml": {"sha256": wanted, "bytes": file.stat().st_size}}
    cdpr.simulate("acrobot_pbvs", SHORT, folder=tmp_path / "ours")
    assert not (tmp_path / "ours" / "inputs.json").exists()  # the code's version says those


def test_files_of_the_package_are_read_where_they_are(tmp_path):
    with inputs_read_once():
        load_robot("acrobot_small")
        assert inputs_held().hashes(tmp_path) == {}
        assert input_path(robot_file("acrobot_small")) == robot_file("acrobot_small")


def test_a_job_is_done_with_what_it_was_sent():
    files = InputFiles()
    assert SentInputs(lambda job: (job, inputs_held() is files), files)(3) == (3, True)


BODY = """\
<robot name="two"><link name="platform"><inertial><mass value="{mass}"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="package://toy/meshes/body.obj"/></geometry></collision>
<visual><geometry><mesh filename="near.obj"/></geometry></visual></link></robot>
"""


@pytest.mark.parametrize("given", ["two.urdf", "two.dmd.yaml"])
def test_bodies_of_mechanisms_and_what_they_name_are_read_once(given, tmp_path):
    toy = tmp_path / "toy"
    (toy / "meshes").mkdir(parents=True)
    (toy / "package.xml").write_text("<package><name>toy</name></package>")
    for mesh in (toy / "meshes" / "body.obj", toy / "near.obj"):
        mesh.write_text(OBJ.format(x=0.1))
    (toy / "two.urdf").write_text(BODY.format(mass=1.5))
    (toy / "two.dmd.yaml").write_text("directives:\n- add_model: {name: two, file: two.urdf}\n")
    file = toy / "mechanism.yaml"
    frame = "platform" if given == "two.urdf" else "two::platform"
    file.write_text(MECHANISM.format(file=given).replace("anchor_frame: platform",
                                                         f"anchor_frame: '{frame}'"))  # fmt: skip

    def mass():
        plant = MultibodyPlant(0.0)
        add_mechanism(plant, load_mechanism(file)).finalize()
        return plant.CalcTotalMass(plant.CreateDefaultContext())

    with inputs_read_once():
        assert mass() == 1.5
        sent = pickle.dumps(inputs_held())
        (toy / "two.urdf").write_text(BODY.format(mass=2.5))
        assert mass() == 1.5
        names = set(inputs_held().hashes(tmp_path))
    assert {"mechanism.yaml", "two.urdf", "body.obj", "near.obj", given} <= names
    assert mass() == 2.5  # so that the edit would have been seen
    shutil.rmtree(toy)
    with inputs_read_once(pickle.loads(sent)):
        assert mass() == 1.5
