"""Files of bodies and meshes that stop Drake, or the process that reads them, are one line."""

import base64
import json
from pathlib import Path

import pytest

from cdpr_drake.errors import CdprError, RobotFileError, WorldError
from cdpr_drake.formats.named_frames import read_named_frames
from cdpr_drake.models import drake_parsing
from cdpr_drake.models.mechanism_loader import parse_mechanism
from cdpr_drake.models.shapes import PlatformShape, mesh_files
from cdpr_drake.systems.worlds.model_files import mesh_parts, model_parts

POINTS = "".join(
    f'<link name="{end}_C{k}"/><joint name="{end}{k}" type="fixed"><parent link="{on}"/>'
    f'<child link="{end}_C{k}"/><origin xyz="{x} 0 {z}"/></joint>'
    for end, on, z in (("exit", "frame", 2), ("anchor", "platform", 0))
    for k, x in ((1, -1), (2, 1))
)


def urdf(shape, origin=""):
    return (
        '<robot name="two"><link name="frame"/><link name="platform"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        f"<collision>{origin}<geometry>{shape}</geometry></collision></link>{POINTS}</robot>"
    )


MECHANISM = """\
name: two
title: two
mechanism: {file}
cable: {{youngs_modulus: 1.0e+9, diameter: 0.002, linear_density: 0.01, retardation_time: 0.0}}
tension_bounds: {{lower: 1.0, upper: 100.0}}
cables:
- {{name: a, exit_point: [0, 0, 1], anchor_frame: platform, anchor_point: [0, 0, 0]}}
"""


def one_line(caught, file):
    words = str(caught.value)
    assert "\n" not in words
    assert str(file) in words
    return words


@pytest.mark.parametrize(
    ("shape", "origin"),
    [
        ('<cylinder radius="1" length="0"/>', ""),
        ('<box size="0 0 0"/>', ""),
        ('<box size="1 1"/>', ""),
        ('<sphere radius="-1"/>', ""),
        ('<capsule radius="-1" length="1"/>', ""),
        ('<ellipsoid semi_axes="0 0 0"/>', ""),
        ('<box size="1 1 1"/>', '<origin rpy="0"/>'),
        ('<box size="1 1 1"/>', '<origin xyz="1 2"/>'),
        ('<mesh filename="bad.obj"/>', ""),
        ('<mesh filename="short.gltf"/>', ""),
    ],
)
def test_shapes_that_drake_asserts_are_one_line(shape, origin, tmp_path, request):
    """A mesh ends the process that reads it, or says there what is wrong; others do so here."""
    if "mesh" not in shape:
        request.getfixturevalue("in_this_process")
    (tmp_path / "bad.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n")
    short_gltf(tmp_path)
    file = tmp_path / "two.urdf"
    file.write_text(urdf(shape, origin))
    with pytest.raises(RobotFileError) as caught:
        read_named_frames(file)
    assert "Drake cannot read it: " in one_line(caught, file)
    with pytest.raises(WorldError) as refused:
        model_parts(str(file), [1, 1, 1, 1])
    one_line(refused, file)
    with pytest.raises(RobotFileError) as mechanism:
        parse_mechanism(MECHANISM.format(file=file.name), tmp_path / "mechanism.yaml")
    assert "two.urdf, which Drake refuses: " in one_line(mechanism, tmp_path)


def test_a_robot_with_proper_shapes_is_read(tmp_path):
    file = tmp_path / "two.urdf"
    file.write_text(urdf('<box size="1 1 0.2"/>'))
    assert [cable.name for cable in read_named_frames(file).cables] == ["C1", "C2"]


def short_gltf(folder: Path) -> Path:
    """A mesh of 1e9 points in a buffer of one, by which VTK's reader leaves its memory."""
    file = folder / "short.gltf"
    data = base64.b64encode(bytes(12)).decode()
    file.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 10**9, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 12}],
        "buffers": [{"byteLength": 12, "uri": f"data:application/octet-stream;base64,{data}"}],
    }))  # fmt: skip
    return file


def test_a_mesh_that_ends_its_reader_ends_no_other(tmp_path):
    file = short_gltf(tmp_path)
    with pytest.raises(WorldError, match="SIG") as caught:
        mesh_parts(str(file), 1.0, [1, 1, 1, 1])
    one_line(caught, file)
    with pytest.raises(RobotFileError, match="SIG") as refused:
        PlatformShape(kind="mesh", file=str(file)).extent([0, 0, 0])
    one_line(refused, file)


@pytest.mark.parametrize("text", ["", "5", "[]", '{"buffers": 5}', '{"images": [[]]}', "9" * 5000])
def test_a_gltf_that_is_none_names_its_file(text, tmp_path):
    file = tmp_path / "some.gltf"
    file.write_text(text)
    with pytest.raises(RobotFileError) as caught:
        mesh_files(file)
    one_line(caught, file)


INCLUDED = {
    "self.dmd.yaml": "directives:\n- add_directives: {{file: '{uri}'}}\n",
    "self.sdf": '<sdf version="1.9"><model name="a"><include><uri>{uri}</uri></include>'
    '<link name="l"/></model></sdf>',
    "self.xml": '<mujoco><include file="self.xml"/></mujoco>',
}
"""What includes itself: two end the process by the size of its stack, one never ends."""


@pytest.mark.parametrize("name", sorted(INCLUDED))
def test_what_includes_itself_is_refused(name, tmp_path, monkeypatch):
    monkeypatch.setattr(drake_parsing, "LONGEST_PARSING", 2)
    file = tmp_path / name
    file.write_text(INCLUDED[name].format(uri=file.as_uri()))
    with pytest.raises(CdprError, match="includes itself") as caught:
        parse_mechanism(MECHANISM.format(file=name), tmp_path / "mechanism.yaml")
    one_line(caught, name)


def test_an_assertion_within_a_block_is_an_error_and_an_end_is_an_end():
    with (
        pytest.raises(RobotFileError, match="some: Failure at"),
        drake_parsing.drake_refusals("some"),
    ):
        raise SystemExit("Failure at")
    with pytest.raises(SystemExit), drake_parsing.drake_refusals("some"):
        raise SystemExit(3)
