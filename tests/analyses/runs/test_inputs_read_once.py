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

OBJ = "v -0.05 -0.05 -0.04\nv {x} 0 0\nv 0 0.1 0\nv 0 0 0.04\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
BODY = """\
<robot name="two"><link name="platform"><inertial><mass value="{x}"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="package://toy/meshes/body.obj"/></geometry></collision>
<visual><geometry><mesh filename="near.obj"/></geometry></visual></link></robot>
"""


def write_robot(file, mass="1.5"):
    text = robot_file("acrobot_small").read_text()
    assert "  mass: 1.5\n" in text
    file.write_text(text.replace("  mass: 1.5\n", f"  mass: {mass}\n"))
    return file


def mesh(folder):
    (folder / "stone.obj").write_text(OBJ.format(x=0.1))
    parts = lambda: mesh_parts(str(folder / "stone.obj"), 1.0, [1, 1, 1, 1])  # noqa: E731
    hull = lambda: parts()[0].shape.GetConvexHull()  # noqa: E731
    return lambda: max(hull().vertex(k)[0] for k in range(hull().num_vertices()))


def camera(folder):
    file = folder / "lens.yaml"
    shutil.copy(Path(cdpr.__file__).parent / "models" / "cameras" / "astra.yaml", file)
    return lambda: load_camera(str(file)).width


def platform_mesh(folder):
    (folder / "body.obj").write_text(OBJ.format(x=0.04))
    shape = "shape: {kind: mesh, file: body.obj, scale: 0.5, position: [0, 0, 0.035]}"
    file = write_robot(folder / "mine.yaml", f"1.5\n  {shape}")
    return lambda: load_robot(file).platform.shape.extent(np.zeros(3))[1].tolist()


def other_tool(folder):
    caspr(folder)
    return lambda: [load_robot(f).platform.mass for f in (folder, folder / "toy_bodies.xml")]


def mechanism(folder, file="two.urdf", frame="platform"):
    (folder / "meshes").mkdir()
    (folder / "package.xml").write_text("<package><name>toy</name></package>")
    for obj in (folder / "meshes" / "body.obj", folder / "near.obj"):
        obj.write_text(OBJ.format(x=0.1))
    (folder / "two.urdf").write_text(BODY.format(x=1.5))
    (folder / "two.dmd.yaml").write_text("directives:\n- add_model: {name: two, file: two.urdf}\n")
    anchored = f"anchor_frame: '{frame}'"
    words = MECHANISM.format(file=file).replace("anchor_frame: platform", anchored)
    (folder / "mechanism.yaml").write_text(words)

    def mass():
        plant = MultibodyPlant(0.0)
        add_mechanism(plant, load_mechanism(folder / "mechanism.yaml")).finalize()
        return plant.CalcTotalMass(plant.CreateDefaultContext())

    return mass


def directives(folder):
    return mechanism(folder, "two.dmd.yaml", "two::platform")


FILES = {
    mesh: ("stone.obj", OBJ.format(x=0.9), set()),
    camera: ("lens.yaml", None, set()),
    platform_mesh: ("body.obj", OBJ.format(x=0.02), {"mine.yaml", "body.obj"}),
    other_tool: ("toy_bodies.xml", None, set()),
    mechanism: ("two.urdf", BODY.format(x=2.5), {"two.urdf", "body.obj", "near.obj"}),
    directives: ("two.urdf", BODY.format(x=2.5), {"two.urdf", "two.dmd.yaml", "near.obj"}),
}
"""A file that is edited, its other words (None: it vanishes), and files whose hashes are kept."""


@pytest.mark.parametrize("kind", FILES)
def test_files_and_what_they_name_are_read_once_also_by_who_has_them_sent(kind, tmp_path):
    name, words, hashed = FILES[kind]
    folder = tmp_path / "toy"
    folder.mkdir()
    read = kind(folder)
    with inputs_read_once():
        first = read()
        sent = pickle.dumps(inputs_held())
        (folder / name).unlink()
        if words is not None:
            (folder / name).write_text(words)
        assert read() == first
        assert hashed <= set(inputs_held().hashes(tmp_path))
    if words is not None:
        assert read() != first  # so that the edit would have been seen
    shutil.rmtree(folder)
    with inputs_read_once(pickle.loads(sent)):
        assert read() == first


def test_a_worker_with_another_file_there_computes_with_ours(tmp_path):
    file = write_robot(tmp_path / "mine.yaml")
    with inputs_read_once():
        load_robot(file)
        sent = pickle.dumps(with_inputs(load_robot))
    write_robot(file, "1.95")
    assert pickle.loads(sent)(file).platform.mass == 1.5
    assert inputs_held() is None
    files = InputFiles()
    assert SentInputs(lambda job: (job, inputs_held() is files), files)(3) == (3, True)


def test_results_have_the_hash_of_what_was_read_unless_it_is_of_the_package(tmp_path, monkeypatch):
    monkeypatch.setattr("cdpr_drake.analyses.runs.run.figure_writers", lambda *_: {})
    file, short = write_robot(tmp_path / "mine.yaml"), ["camera.kind=projected", "duration=0.1"]
    cdpr.simulate("acrobot_pbvs", [*short, f"robot={file}"], folder=tmp_path / "run")
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    assert json.loads((tmp_path / "run" / "inputs.json").read_text()) == {
        "mine.yaml": {"sha256": digest, "bytes": file.stat().st_size}
    }
    cdpr.simulate("acrobot_pbvs", short, folder=tmp_path / "ours")
    assert not (tmp_path / "ours" / "inputs.json").exists()  # the code's version says those
    with inputs_read_once():
        load_robot("acrobot_small")
        assert inputs_held().hashes(tmp_path) == {}
        assert input_path(robot_file("acrobot_small")) == robot_file("acrobot_small")
