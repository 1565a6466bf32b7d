"""A mechanism in Meshcat: its bodies, and its cables coloured by the tensions that hold it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from pydrake.geometry import (
    Meshcat,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    Role,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, DiagramBuilder

from cdpr_drake.analyses.visualization.replay import CLOCK, look_at
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.errors import CableGeometryError, EquilibriumError, InfeasibleTensionError
from cdpr_drake.geometry.cable_routes import CableRoutes
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import hang
from cdpr_drake.palette import OUTLINE, rgb
from cdpr_drake.systems.monitoring.meshcat_cables import THIN, CableChains


class MechanismScene:
    """A mechanism in Meshcat that can be posed, with its cables.

    Cables are drawn from point to point, without pulleys, as straight ones.

    Attributes:
        meshcat: Where it is shown.
        plant: Its plant, with a SceneGraph.
        routes: Its cables.
        plant_context: Of the plant; its positions are drawn.
    """

    def __init__(self, mechanism: Mechanism, meshcat: Meshcat) -> None:
        """Puts its bodies into Meshcat.

        Raises:
            RobotFileError: Drake refuses its file.
        """
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        self.meshcat, self.plant = meshcat, plant
        added = add_mechanism(plant, mechanism)
        added.finalize()
        params = MeshcatVisualizerParams(publish_period=1.0 / CLOCK)  # of recordings alone
        self._visualizer = MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, params)
        self._diagram = builder.Build()
        self._context: Context = self._diagram.CreateDefaultContext()
        self.plant_context: Context = plant.GetMyMutableContextFromRoot(self._context)
        self.routes = added.routes()
        self._corners = _corners(plant, scene_graph)
        self._diameter = max(each.diameter for each in mechanism.materials())
        self._chains: CableChains | None = None

    def points(self) -> Array:
        """Where the points of all routes are in W, shape (3, s) [m]."""
        return route_points(self.plant, self.routes, self.plant_context)

    def box(self) -> tuple[Array, Array]:
        """Lower and upper corner in W of a box round all points of cables and shapes of bodies,
        shape (3,) each [m]."""
        found = [*self.points().T]
        for body, points in self._corners:
            found += [*self.plant.EvalBodyPoseInWorld(self.plant_context, body).multiply(points).T]
        return np.min(found, axis=0), np.max(found, axis=0)

    def show_cables(self, full_scale: float, lower: Array, upper: Array) -> None:
        """Makes the cables, coloured up to a tension [N], for a box from lower to upper in W [m]
        that fills the window."""
        size = float(np.linalg.norm(upper - lower))
        radius = max(THIN * size, self._diameter / 2.0)
        paths = [f"cables/{name}" for name in self.routes.names]
        self._chains = CableChains(self.meshcat, paths, radius, full_scale)
        for path in self._point_paths():
            self.meshcat.SetObject(path, Sphere(2.0 * radius), Rgba(*rgb(OUTLINE.color)))
        look_at(self.meshcat, lower, upper)

    def draw(self, tensions: Array, time: float | None = None) -> np.ndarray:
        """Draws bodies and cables at the positions that the plant has.

        Args:
            tensions: Shape (m,) [N]; a cable without any is red, one with NaN grey.
            time: While Meshcat records, where this goes in the recording [s].

        Returns:
            Which cables are slack, shape (m,), bool.
        """
        assert self._chains is not None
        self._context.SetTime(time or 0.0)
        self._visualizer.ForcedPublish(self._visualizer.GetMyContextFromRoot(self._context))
        points, first = self.points(), self.routes.first
        curves = [points[:, first[i] : first[i + 1]] for i in range(self.routes.count)]
        slack = np.asarray(tensions <= 0.0)
        self._chains.follow(curves, tensions, slack, time)
        for path, point in zip(self._point_paths(), points.T, strict=True):
            self.meshcat.SetTransform(path, RigidTransform(point), time)
        return slack

    def record(self) -> None:
        """From now on, `draw` with a time writes into the recording."""
        self._visualizer.StartRecording(set_transforms_while_recording=False)

    def exits(self) -> Array:
        """Where the exit points are in W, shape (3, m) [m]."""
        return self.points()[:, self.routes.first[:-1]]

    def _point_paths(self) -> list[str]:
        first = self.routes.first
        return [
            f"points/{name}/{k}"
            for i, name in enumerate(self.routes.names)
            for k in range(first[i + 1] - first[i])
        ]


def _corners(plant: MultibodyPlant, scene_graph: SceneGraph) -> list[tuple[Any, Array]]:
    """Corners of a box round each shape that is shown, on its body, shape (3, 8) [m]."""
    found, inspector = [], scene_graph.model_inspector()
    for geometry in inspector.GetAllGeometryIds(Role.kIllustration):
        box = inspector.GetObbInGeometryFrame(geometry)
        body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
        if box is None or body is None:  # as a half-space, which no window holds
            continue
        X_BG = inspector.GetPoseInFrame(geometry)
        signs = np.array(list(product((-1.0, 1.0), repeat=3))).T
        corners = signs * box.half_width()[:, None]
        found.append((body, X_BG.multiply(box.pose()).multiply(corners)))
    return found


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

    Where no tensions hold it the cables are grey, and `problem` says why.

    Raises:
        RobotFileError: Drake refuses its file.
    """
    scene = MechanismScene(mechanism, meshcat)
    low, high = mechanism.tension_limits()
    problem = ""
    try:
        cables = PlantCables(scene.plant, scene.routes, ELASTIC)
        rest = hang(cables, scene.plant_context, lower=low if low > 0.0 else None, upper=high)
        scene.plant.SetPositions(scene.plant_context, rest.positions)
        tensions = rest.tensions
    except (CableGeometryError, EquilibriumError, InfeasibleTensionError) as found:
        tensions, problem = np.full(scene.routes.count, np.nan), str(found)
    most = 1.0 if problem else 2.0 * max(float(np.max(tensions)), 1e-9)
    scene.show_cables(most, *scene.box())
    scene.draw(tensions)
    return MechanismPicture(meshcat, problem)


def route_points(plant: MultibodyPlant, routes: CableRoutes, context: Context) -> Array:
    """Where the points of all routes are in W, at a context of the plant, shape (3, s) [m]."""
    found = np.empty_like(routes.p_BQ)
    for k, body in enumerate(routes.bodies):
        X_WB = plant.EvalBodyPoseInWorld(context, plant.get_body(BodyIndex(int(body))))
        found[:, k] = X_WB.multiply(routes.p_BQ[:, k])
    return found
