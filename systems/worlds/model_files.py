"""Parts of bodies, from meshes and from the models of simulators."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.geometry import HalfSpace, Mesh, Rgba, SceneGraphInspector, Shape
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.arrays import Array
from cdpr_drake.errors import WorldError
from cdpr_drake.models.drake_parsing import drake_refusals, named_files, parse_models, try_mesh
from cdpr_drake.models.shapes import mesh_in_place
from cdpr_drake.schema.input_files import input_bytes, input_path, input_there

MESH_SUFFIXES = (".obj", ".gltf")
MODEL_SUFFIXES = (".sdf", ".urdf")


@dataclass(frozen=True, eq=False)
class Part:
    """One shape of a body.

    Attributes:
        shape: The shape.
        X_BG: Its pose in the body's frame [m].
        color: Red, green, blue and opacity, shape (4,); None: what its file says.
        shown: Whether it is drawn.
        solid: Whether it can be touched.
    """

    shape: Shape
    X_BG: RigidTransform
    color: Array | None
    shown: bool = True
    solid: bool = True


def mesh_parts(file: str, scale: float, color: Array) -> tuple[Part, ...]:
    """A mesh as it is drawn and, by its convex hull, touched.

    Args:
        file: Path of an .obj or .gltf file.
        scale: Metres per unit of the file.
        color: For a mesh that has no colours of its own.

    Raises:
        WorldError: It cannot be read.
    """
    _check_file(file, MESH_SUFFIXES)
    with drake_refusals(f"{file}: is no mesh that can be read", WorldError):
        place = mesh_in_place(Path(file))
        try_mesh(place)
        mesh = Mesh(str(place), scale)
        mesh.GetConvexHull()
    coloured = file.lower().endswith(".gltf") or b"mtllib" in input_bytes(Path(file))
    return (Part(mesh, RigidTransform(), None if coloured else color),)


def model_parts(file: str, color: Array) -> tuple[Part, ...]:
    """All shapes of a model in the frame of the model, its joints at the angles of the file.

    Args:
        file: Path of an SDFormat or URDF file.
        color: For shapes that have no colours of their own.

    Raises:
        WorldError: It cannot be read, has several models or no shapes, or a shape is a plane.
    """
    _check_file(file, MODEL_SUFFIXES)
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    with drake_refusals(f"{file}: is no model that can be read", WorldError):
        instances = parse_models(Parser(plant), input_path(Path(file), named_files(Path(file))))
        plant.Finalize()
    if len(instances) != 1:
        raise WorldError(f"{file}: found {len(instances)} models; accepted: one")
    context = builder.Build().CreateDefaultContext()
    plant_context = plant.GetMyContextFromRoot(context)
    X_WM = plant.GetFrameByName("__model__", instances[0]).CalcPoseInWorld(plant_context)
    found: list[Part] = []
    inspector = scene_graph.model_inspector()
    for index in plant.GetBodyIndices(instances[0]):
        body = plant.get_body(index)
        X_MB = X_WM.inverse() @ plant.EvalBodyPoseInWorld(plant_context, body)
        for geometry in plant.GetVisualGeometriesForBody(body):
            found.append(_shown(inspector, geometry, X_MB, color))
        for geometry in plant.GetCollisionGeometriesForBody(body):
            shape, X_BG = inspector.GetShape(geometry), inspector.GetPoseInFrame(geometry)
            found.append(Part(shape, X_MB @ X_BG, None, shown=False))
    if not found:
        raise WorldError(f"{file}: found a model without shapes; accepted: one that has some")
    if any(isinstance(part.shape, HalfSpace) for part in found):
        raise WorldError(f"{file}: found a plane; accepted: solid shapes, and world.ground")
    return tuple(found)


def _shown(
    inspector: SceneGraphInspector, geometry: object, X_MB: RigidTransform, color: Array
) -> Part:
    properties = inspector.GetIllustrationProperties(geometry)
    own = properties is not None and properties.HasProperty("phong", "diffuse")
    if own:
        rgba: Rgba = properties.GetProperty("phong", "diffuse")
        color = np.array([rgba.r(), rgba.g(), rgba.b(), rgba.a()])
    shape = inspector.GetShape(geometry)
    mesh = isinstance(shape, Mesh)
    X_MG = X_MB @ inspector.GetPoseInFrame(geometry)
    return Part(shape, X_MG, None if mesh and not own else color, solid=False)


def _check_file(file: str, suffixes: tuple[str, ...]) -> None:
    if not file.lower().endswith(suffixes):
        raise WorldError(f"found {file}; accepted: a file {' or '.join(suffixes)}")
    if not input_there(Path(file)):
        raise WorldError(f"{file}: there is no such file")
