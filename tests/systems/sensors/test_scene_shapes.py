"""Rays in a scene graph against Drake's distances: it has no rays, but knows how far things are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common import MemoryFile
from pydrake.geometry import (
    Box,
    Ellipsoid,
    GeometryInstance,
    InMemoryMesh,
    Mesh,
    MeshcatCone,
    PerceptionProperties,
    Sphere,
)
from pydrake.math import RigidTransform

from cdpr_drake.errors import SensorError
from cdpr_drake.systems.sensors.scene_shapes import SceneShapes
from tests.systems.sensors.scenes import query_of, random_pose, random_shape, scene_of

ON_SURFACE = 1e-11
"""Metres: roundings of numbers of metres; what Drake says of half spaces far away is worst."""

ELLIPSOIDS = 1e-4
"""Metres: Drake iterates for these, and stops early; their own equation says more."""

TRACED = 1e-6
"""Metres: where tracing stops."""

KINDS = ("box", "sphere", "cylinder", "capsule", "ellipsoid", "half_space", "convex")
BEAMS = 24


def traced(query, origin, direction, limit):
    """Distance to the first surface by going on as far as nothing is, again and again."""
    t = 0.0
    for _ in range(400):
        found = query.ComputeSignedDistanceToPoint(origin + t * direction)
        step = min(abs(entry.distance) for entry in found)
        t += step
        if step < 0.1 * TRACED or t > limit:
            break
    return t


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_rays_end_where_drake_says_that_a_surface_is(seed):
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 6))
    kinds = [str(random.choice(KINDS)) for _ in range(count)]
    shapes = [(random_shape(random, kind), random_pose(random)) for kind in kinds]
    scene_graph, ids = scene_of(shapes)
    query, _context = query_of(scene_graph)
    origin = random.uniform(-3.0, 3.0, 3)
    directions = random.standard_normal((BEAMS, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    found, hits = SceneShapes().cast(query, origin, directions)
    at_start = query.ComputeSignedDistanceToPoint(origin)
    sides = {entry.id_G: entry.distance > 0.0 for entry in at_start}
    for distance, hit, direction in zip(found, hits, directions, strict=True):
        if hit is None:
            assert distance == np.inf
            assert traced(query, origin, direction, 20.0) > 19.0
            continue
        there = query.ComputeSignedDistanceToPoint(origin + distance * direction)
        mine = next(entry.distance for entry in there if entry.id_G == hit)
        shape, X_WG = shapes[ids.index(hit)]
        if isinstance(shape, Ellipsoid):
            p_G = X_WG.inverse() @ (origin + distance * direction)
            mine = np.linalg.norm(p_G / [shape.a(), shape.b(), shape.c()]) - 1.0
        assert abs(mine) < ON_SURFACE
        # Nothing is before it: the way there crosses no surface.
        for share in (0.25, 0.5, 0.75, 0.95):
            on_way = query.ComputeSignedDistanceToPoint(origin + share * distance * direction)
            clear = [e for e in on_way if abs(e.distance) > ELLIPSOIDS]
            assert all(sides[e.id_G] == (e.distance > 0.0) for e in clear)


def test_a_ray_is_where_tracing_by_drakes_distances_ends():
    """Independent of what is hit; the way is traced, not solved."""
    random = np.random.default_rng(7)
    kinds = [kind for kind in KINDS if kind != "ellipsoid"]
    shapes = [(random_shape(random, kind), random_pose(random, 3.0)) for kind in kinds]
    scene_graph, _ = scene_of(shapes)
    query, _context = query_of(scene_graph)
    angles = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    directions = np.column_stack([np.cos(angles), np.sin(angles), 0.2 * np.sin(3 * angles)])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    origin = np.array([0.1, 0.2, 0.3])
    found, _ = SceneShapes().cast(query, origin, directions)
    checked = 0
    for distance, direction in zip(found, directions, strict=True):
        if distance < 15.0:
            end = traced(query, origin, direction, 30.0)
            # A ray that grazes a surface comes near to it long before it meets it.
            if abs(end - distance) < 0.05:
                assert end == pytest.approx(distance, abs=20.0 * TRACED)
                checked += 1
    assert checked > 20


def test_only_what_has_the_role_is_seen():
    near = (Sphere(0.5), RigidTransform([2.0, 0, 0]))
    scene_graph, _ = scene_of([near], roles=("proximity",))
    source = scene_graph.RegisterSource("other")
    instance = GeometryInstance(RigidTransform([5, 0, 0]), Box(1, 1, 1), "wall")
    instance.set_perception_properties(PerceptionProperties())
    scene_graph.RegisterAnchoredGeometry(source, instance)
    query, _context = query_of(scene_graph)
    ahead = np.array([[1.0, 0.0, 0.0]])
    assert SceneShapes("perception").cast(query, np.zeros(3), ahead)[0][0] == pytest.approx(4.5)
    assert SceneShapes("proximity").cast(query, np.zeros(3), ahead)[0][0] == pytest.approx(1.5)


def test_meshes_from_memory_and_from_files_are_seen(tmp_path):
    text = "v 0 -1 -1\nv 0 1 -1\nv 0 1 1\nv 0 -1 1\nf 1 2 3 4\n"
    path = tmp_path / "plate.obj"
    path.write_text(text)
    held = Mesh(InMemoryMesh(mesh_file=MemoryFile(text.encode(), ".obj", "plate")))
    for shape, reach in ((held, 0.99), (Mesh(str(path), 2.0), 1.99)):
        scene_graph, _ = scene_of([(shape, RigidTransform([3.0, 0, 0]))], roles=("perception",))
        query, _context = query_of(scene_graph)
        found, _ = SceneShapes().cast(
            query, np.array([0.0, reach, 0.0]), np.array([[1.0, 0.0, 0.0]])
        )
        assert found[0] == pytest.approx(3.0, abs=1e-12)


def test_gltf_is_turned_as_drake_turns_it(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / "brick.gltf"
    brick = trimesh.creation.box((0.2, 0.6, 1.4))
    brick.apply_translation((0.1, 0.2, 0.3))
    files = trimesh.exchange.gltf.export_gltf(trimesh.Scene(brick))
    for name, contents in files.items():
        (path if name.endswith(".gltf") else tmp_path / name).write_bytes(contents)
    shape = Mesh(str(path))
    hull = shape.GetConvexHull()
    points = np.array([hull.vertex(i) for i in range(hull.num_vertices())])
    scene_graph, _ = scene_of([(shape, RigidTransform())], roles=("perception",))
    query, _context = query_of(scene_graph)
    middle = 0.5 * (np.max(points, axis=0) + np.min(points, axis=0))
    found, _ = SceneShapes().cast(query, middle, np.vstack([np.eye(3), -np.eye(3)]))
    sides = 0.5 * np.ptp(points, axis=0)
    np.testing.assert_allclose(found, np.tile(sides, 2), atol=1e-6)  # single precision in the file


def test_a_scene_that_changes_is_read_again():
    scene_graph, _ = scene_of([(Sphere(0.5), RigidTransform([2.0, 0, 0]))], roles=("perception",))
    source = scene_graph.RegisterSource("later")
    context = scene_graph.CreateDefaultContext()
    port, shapes = scene_graph.get_query_output_port(), SceneShapes()
    ahead = np.array([[1.0, 0.0, 0.0]])
    assert shapes.cast(port.Eval(context), np.zeros(3), ahead)[0][0] == pytest.approx(1.5)
    instance = GeometryInstance(RigidTransform([1.0, 0, 0]), Box(1, 1, 1), "late")
    instance.set_perception_properties(PerceptionProperties())
    scene_graph.RegisterGeometry(context, source, scene_graph.world_frame_id(), instance)
    assert shapes.cast(port.Eval(context), np.zeros(3), ahead)[0][0] == pytest.approx(0.5)


def test_a_shape_without_rays_is_refused_by_name():
    scene_graph, _ = scene_of([(MeshcatCone(1.0), RigidTransform())], roles=("perception",))
    query, _context = query_of(scene_graph)
    with pytest.raises(SensorError, match="shape_0: found a MeshcatCone"):
        SceneShapes().cast(query, np.zeros(3), np.eye(3))
