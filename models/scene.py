"""Shows what stands around the platform: frame, ground, and targets as textured plates."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import (
    Box,
    GeometryInstance,
    IllustrationProperties,
    InMemoryMesh,
    MakePhongIllustrationProperties,
    Mesh,
    PerceptionProperties,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.vision.apriltags import tag_plate
from cdpr_drake.vision.target import Plate

FLOOR_COLOR = np.array([0.62, 0.62, 0.60, 1.0])
_BEAM_COLOR = np.array([0.30, 0.32, 0.35, 1.0])

GROUND_DEPTH = 1e-3
"""The visible ground lies this far below z = 0 [m], so that a tag at z = 0 hides it."""


def add_frame(plant: MultibodyPlant, robot: Robot) -> None:
    """Draws the frame's beams: its own, or twelve that are centred on the edges of its box."""
    for number, beam_of_frame in enumerate(robot.frame.beams):
        middle = (beam_of_frame.start + beam_of_frame.end) / 2.0
        X_WBeam = RigidTransform(RotationMatrix(beam_of_frame.axes()), middle)
        shape = Box(*beam_of_frame.size(robot.frame.beam_width()))
        name = f"{robot.name}_beam_{number}"
        plant.RegisterVisualGeometry(plant.world_body(), X_WBeam, shape, name, _BEAM_COLOR)
    if robot.frame.beams:
        return
    lower, upper, beam = robot.frame.lower, robot.frame.upper, robot.frame.beam_width()
    middle = (lower + upper) / 2.0
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        for number, ends in enumerate(product((0, 1), repeat=2)):
            size = np.full(3, beam)
            size[axis] = upper[axis] - lower[axis] + beam
            position = middle.copy()
            for k, end in zip(others, ends, strict=True):
                position[k] = upper[k] if end else lower[k]
            name = f"{robot.name}_beam_{'xyz'[axis]}{number}"
            plant.RegisterVisualGeometry(
                plant.world_body(), RigidTransform(position), Box(*size), name, _BEAM_COLOR
            )


def add_ground(plant: MultibodyPlant, robot: Robot) -> None:
    """Shows a floor under the frame and half its width around it, `GROUND_DEPTH` below z = 0.

    For the browser only: cameras have a background of its colour. To shade a floor of one colour
    takes the rendered image a quarter of its time and more, and changes no corner of a target.
    """
    width = 2.0 * (robot.frame.upper - robot.frame.lower)[:2]
    middle = (robot.frame.upper + robot.frame.lower)[:2] / 2.0
    thickness = 0.05
    X_WGround = RigidTransform([*middle, -GROUND_DEPTH - thickness / 2.0])
    floor = GeometryInstance(X_WGround, Box(*width, thickness), "ground")
    floor.set_illustration_properties(MakePhongIllustrationProperties(FLOOR_COLOR))
    plant.RegisterVisualGeometry(plant.world_body(), floor)


def plate_mesh(png: bytes, width: float) -> Mesh:
    """A flat square with a picture, x right, y up, z out of it, held in memory.

    Args:
        png: The picture, a PNG file.
        width: Edge [m].
    """
    h = width / 2.0
    obj = "\n".join(
        [
            "mtllib plate.mtl",
            *(f"v {x * h} {y * h} 0" for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))),
            "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1",
            "usemtl plate\nf 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n",
        ]
    )
    mtl = "newmtl plate\nKa 1 1 1\nKd 1 1 1\nmap_Kd plate.png\n"
    return Mesh(
        InMemoryMesh(
            mesh_file=MemoryFile(obj.encode(), ".obj", "plate.obj"),
            supporting_files={
                "plate.mtl": MemoryFile(mtl.encode(), ".mtl", "plate.mtl"),
                "plate.png": MemoryFile(png, ".png", "plate.png"),
            },
        )
    )


def plate_geometry(plate: Plate, X_FO: RigidTransform, name: str) -> GeometryInstance:
    """A plate of an object at X_FO in a frame F, for pictures and for the browser."""
    # Not by a colour, which Drake would say that it ignores: the mesh brings its own.
    mesh = plate_mesh(plate.png, plate.width)
    instance = GeometryInstance(X_FO @ plate.X_OT, mesh, name)
    instance.set_illustration_properties(IllustrationProperties())
    instance.set_perception_properties(PerceptionProperties())
    return instance


def add_plates(
    plant: MultibodyPlant,
    plates: Sequence[Plate],
    X_BO: RigidTransform,
    name: str,
    body: RigidBody | None = None,
) -> None:
    """Fixes the plates of an object to a body of the plant.

    Args:
        plant: A plant that is registered with a SceneGraph and not finalized.
        plates: The plates.
        X_BO: Pose of the object's frame O in the body frame.
        name: First part of the geometries' names.
        body: The body; None: the world.
    """
    parent = plant.world_body() if body is None else body
    for number, plate in enumerate(plates):
        numbered = f"{name}_{number}" if number else name
        plant.RegisterVisualGeometry(
            parent, plate_geometry(plate, X_BO, f"{numbered}_on_{parent.name()}")
        )


def add_tag(
    plant: MultibodyPlant,
    tag_id: int,
    size: float,
    X_BO: RigidTransform,
    body: RigidBody | None = None,
) -> None:
    """Fixes an AprilTag 36h11 to a body of the plant.

    Args:
        plant: A plant that is registered with a SceneGraph and not finalized.
        tag_id: Identity of the tag, 0..586.
        size: Edge of the black square [m].
        X_BO: Pose of the tag frame O (x right, y up, z out of the tag) in the body frame.
        body: The body; None: the world.
    """
    add_plates(plant, [tag_plate(tag_id, size, RigidTransform())], X_BO, f"tag_{tag_id}", body)
