"""Scenes of simple shapes for the tests of this folder."""

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    HalfSpace,
    PerceptionProperties,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix


def random_shape(random, kind):
    a, b, c = random.uniform(0.1, 1.0, 3)
    points = random.uniform(-0.8, 0.8, (3, 8))
    return {
        "box": lambda: Box(a, b, c),
        "sphere": lambda: Sphere(a),
        "cylinder": lambda: Cylinder(a, b),
        "capsule": lambda: Capsule(a, b),
        "ellipsoid": lambda: Ellipsoid(a, b, c),
        "half_space": HalfSpace,
        "convex": lambda: Convex(points, "points"),
    }[kind]()


def random_pose(random, spread=2.0):
    Q, R = np.linalg.qr(random.standard_normal((3, 3)))
    Q = Q * np.sign(np.diag(R))
    if np.linalg.det(Q) < 0.0:
        Q[:, 2] *= -1.0
    return RigidTransform(RotationMatrix(Q), random.uniform(-spread, spread, 3))


def scene_of(shapes, roles=("perception", "proximity")):
    """A scene graph with anchored shapes at poses; and its ids."""
    scene_graph = SceneGraph()
    source = scene_graph.RegisterSource("test")
    ids = []
    for number, (shape, X_WG) in enumerate(shapes):
        instance = GeometryInstance(X_WG, shape, f"shape_{number}")
        if "perception" in roles:
            instance.set_perception_properties(PerceptionProperties())
        if "proximity" in roles:
            instance.set_proximity_properties(ProximityProperties())
        ids.append(scene_graph.RegisterAnchoredGeometry(source, instance))
    return scene_graph, ids


def query_of(scene_graph):
    """Its query object, and the context that must outlive it."""
    context = scene_graph.CreateDefaultContext()
    return scene_graph.get_query_output_port().Eval(context), context
