"""Rays and the first surface on each: boxes, spheres, cylinders, capsules, ellipsoids, meshes.

Frames: W the world, G of a shape, S of a sensor (x ahead, y to the left). Distances are along the
ray [m], infinite where it meets nothing. Drake's SceneGraph answers distances and contact, but no
rays; `systems.perception` packs its shapes for these kernels.

Source: Ericson, Real-Time Collision Detection, 2005.
"""

from cdpr_drake.rays.beams import fan_angles, fan_directions, reported_ranges
from cdpr_drake.rays.shapes import (
    RayScene,
    RayShape,
    box,
    capsule,
    cylinder,
    ellipsoid,
    half_space,
    mesh,
    sphere,
)
from cdpr_drake.rays.triangles import fan_triangles, obj_triangles

__all__ = [
    "RayScene", "RayShape", "box", "capsule", "cylinder", "ellipsoid", "fan_angles",
    "fan_directions", "fan_triangles", "half_space", "mesh", "obj_triangles", "reported_ranges",
    "sphere",
]  # fmt: skip
