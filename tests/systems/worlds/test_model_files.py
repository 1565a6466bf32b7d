"""Bodies from meshes and from models of simulators."""

import numpy as np
import pytest
from pydrake.geometry import Box, Mesh
from pydrake.math import RigidTransform

from cdpr_drake.errors import WorldError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.worlds.clearances import WorldClearances
from cdpr_drake.systems.worlds.model_files import mesh_parts, model_parts
from cdpr_drake.systems.worlds.world import make_world
from tests.systems.worlds.world_bench import obstacle, world_of

GREY = np.array([0.5, 0.5, 0.5, 1.0])

CUBE = "\n".join(
    [
        *(f"v {x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)),
        "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n",
    ]
)
"""A cube of 2 units."""

MODEL = """<sdf version="1.7"><model name="gate"><pose>5 6 7 0 0 0.3</pose>
<link name="post"><pose>0.5 0 0 0 0 0</pose>
<visual name="v"><geometry><box><size>1 2 3</size></box></geometry>
<material><diffuse>1 0 0 1</diffuse></material></visual>
<collision name="c"><pose>0 0 1 0 0 0</pose><geometry><box><size>1 2 3</size></box></geometry>
</collision></link></model></sdf>"""


@pytest.fixture
def cube(tmp_path):
    path = tmp_path / "cube.obj"
    path.write_text(CUBE)
    return str(path)


def test_a_mesh_is_solid_and_as_large_as_its_scale_says(cube):
    (part,) = mesh_parts(cube, 0.1, GREY)
    assert isinstance(part.shape, Mesh)
    assert part.solid
    assert part.shown
    robot = load_robot("acrobot_large")
    body = obstacle("cube", "mesh", (0.0, 0.0, 0.1), file=cube, scale=0.1)
    clearances = WorldClearances(
        robot, make_world(world_of(body, ground=None), robot), robot.cable_set()
    )
    (gap,) = clearances.platform(RigidTransform([0.0, 0.0, 0.5]), 0.0)
    assert gap == pytest.approx(0.3, abs=2e-6)
    assert np.isnan(clearances.cables(RigidTransform([0.0, 0.0, 0.5]), 0.0))


def test_a_model_has_its_shapes_in_the_frame_of_the_model(tmp_path):
    path = tmp_path / "gate.sdf"
    path.write_text(MODEL)
    seen, solid = model_parts(str(path), GREY)
    assert isinstance(seen.shape, Box)
    assert (seen.shown, seen.solid, solid.shown, solid.solid) == (True, False, False, True)
    np.testing.assert_allclose(seen.X_BG.translation(), [0.5, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(solid.X_BG.translation(), [0.5, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(seen.color, [1.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("none.sdf", None, "there is no such file"),
        ("model.blend", "", "accepted: a file .sdf or .urdf"),
        ("bad.sdf", "<sdf", "no model that can be read"),
        (
            "empty.sdf",
            '<sdf version="1.7"><model name="m"><link name="l"/></model></sdf>',
            "without shapes",
        ),
        (
            "plane.sdf",
            '<sdf version="1.7"><model name="m"><static>true</static><link name="l"><collision '
            'name="c"><geometry><plane><normal>0 0 1</normal></plane></geometry></collision>'
            "</link></model></sdf>",
            "found a plane",
        ),
    ],
)
def test_models_that_cannot_be_are_refused_in_one_line(tmp_path, name, content, words):
    path = tmp_path / name
    if content is not None:
        path.write_text(content)
    with pytest.raises(WorldError, match=words) as problem:
        model_parts(str(path), GREY)
    assert "\n" not in str(problem.value)
    assert len(str(problem.value)) <= 500


def test_a_mesh_that_is_none_is_refused_in_one_line(tmp_path):
    path = tmp_path / "bad.obj"
    path.write_text("nothing")
    with pytest.raises(WorldError, match="no mesh that can be read") as problem:
        mesh_parts(str(path), 1.0, GREY)
    assert "\n" not in str(problem.value)
