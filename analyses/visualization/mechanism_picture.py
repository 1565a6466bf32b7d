"""A mechanism in Meshcat: its bodies, and its cables coloured by the tensions that hold it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Cylinder, Meshcat, MeshcatVisualizer, Rgba, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, DiagramBuilder

from cdpr_drake.analyses.visualization.replay import look_at
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import CableGeometryError, EquilibriumError, InfeasibleTensionError
from cdpr_drake.geometry.cable_routes import CableRoutes
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import hang
from cdpr_drake.systems.monitoring.meshcat_cables import (
    SLACK_COLOR,
    TENSION_COLORS,
    UNKNOWN_COLOR,
)

THIN = 1.6e-3
"""Radius of a drawn cable at least, of the size of what is shown."""


@dataclass(frozen=True, eq=False)
class MechanismPicture:
    """A mechanism in Meshcat.

    Attributes:
        meshcat: Where it is shown.
        problem: Why the cables are grey, in one line; empty where tensions hold it.
    """

    meshcat: Meshcat
    problem: str

    def html(self) -> str:
        """The scene as one page that needs no server."""
        return str(self.meshcat.StaticHtml())


def mechanism_picture(mechanism: Mechanism, meshcat: Meshcat) -> MechanismPicture:
    """A mechanism at its home, held by its cables, in Meshcat.

    Cables are drawn from point to point, without pulleys. Where no tensions hold it they are grey,
    and `problem` says why.

    Raises:
        RobotFileError: Drake refuses its file.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    added = add_mechanism(plant, mechanism)
    added.finalize()
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context, routes = plant.GetMyMutableContextFromRoot(context), added.routes()
    low, high = mechanism.tension_limits()
    problem = ""
    try:
        cables = PlantCables(plant, routes.without_pulleys(), ELASTIC)
        rest = hang(cables, plant_context, lower=low if low > 0.0 else None, upper=high)
        plant.SetPositions(plant_context, rest.positions)
        tensions = rest.tensions
    except (CableGeometryError, EquilibriumError, InfeasibleTensionError) as found:
        tensions, problem = np.full(routes.count, np.nan), str(found)
    diagram.ForcedPublish(context)
    points = route_points(plant, routes, plant_context)
    lower, upper = points.min(axis=1), points.max(axis=1)
    size = float(np.linalg.norm(upper - lower))
    radius = max(THIN * size, max(each.diameter for each in mechanism.materials()) / 2.0)
    most = 1.0 if problem else 2.0 * max(float(np.max(tensions)), 1e-9)
    for i, name in enumerate(routes.names):
        color = _color(float(tensions[i]), most)
        own = points[:, routes.first[i] : routes.first[i + 1]]
        for k in range(own.shape[1]):
            place = RigidTransform(own[:, k])
            meshcat.SetObject(f"cables/{name}/point{k}", Sphere(2.0 * radius), color)
            meshcat.SetTransform(f"cables/{name}/point{k}", place)
        for k in range(own.shape[1] - 1):
            way = own[:, k + 1] - own[:, k]
            length = float(np.linalg.norm(way))
            R = RotationMatrix.MakeFromOneVector(way, 2)
            meshcat.SetObject(f"cables/{name}/{k}", Cylinder(radius, length), color)
            middle = RigidTransform(R, own[:, k] + way / 2.0)
            meshcat.SetTransform(f"cables/{name}/{k}", middle)
    look_at(meshcat, lower, upper)
    return MechanismPicture(meshcat, problem)


def route_points(plant: MultibodyPlant, routes: CableRoutes, context: Context) -> Array:
    """Where the points of all routes are in W, at a context of the plant, shape (3, s) [m]."""
    found = np.empty_like(routes.p_BQ)
    for k, body in enumerate(routes.bodies):
        X_WB = plant.EvalBodyPoseInWorld(context, plant.get_body(BodyIndex(int(body))))
        found[:, k] = X_WB.multiply(routes.p_BQ[:, k])
    return found


def _color(tension: float, most: float) -> Rgba:
    if np.isnan(tension):
        return UNKNOWN_COLOR
    if tension <= 0.0:
        return SLACK_COLOR
    level = int(min(tension / most, 1.0) * len(TENSION_COLORS))
    return TENSION_COLORS[min(level, len(TENSION_COLORS) - 1)]
