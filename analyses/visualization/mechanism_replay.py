"""Mechanisms in Meshcat: bodies, and cables coloured by tensions; runs as recordings."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat, Rgba, Role, SceneGraph, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import Context, DiagramBuilder

from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat
from cdpr_drake.analyses.visualization.replay import (
    BYTES_EACH,
    FEWEST_FRAMES,
    LARGEST_PAGE,
    REPLAY_RATE,
    UNHELD,
    RecordedScene,
    fitting_page,
    frame_indices,
    look_at,
    sampled_rows,
)
from cdpr_drake.analyses.visualization.replay_page import frame_signals, packed, tension_curves
from cdpr_drake.arrays import Array
from cdpr_drake.cables.models import ELASTIC
from cdpr_drake.geometry.cable_routes import CableRoutes
from cdpr_drake.models.mechanism_in_plant import add_mechanism
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import hang
from cdpr_drake.palette import OUTLINE, rgb
from cdpr_drake.systems.monitoring.meshcat_cables import THIN, CableChains


class MechanismScene(RecordedScene):
    """A mechanism in Meshcat that can be posed, with its cables.

    Cables are drawn from point to point, without pulleys, as straight ones.

    Attributes:
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
        added = add_mechanism(plant, mechanism)
        added.finalize()
        super().__init__(meshcat, builder, scene_graph.get_query_output_port())
        self.plant = plant
        self.plant_context: Context = plant.GetMyMutableContextFromRoot(self._context)
        self.routes = added.routes()
        self._corners = _corners(plant, scene_graph)
        self._diameter = max(each.diameter for each in mechanism.materials())
        self._chains: CableChains | None = None

    def points(self) -> Array:
        """Where the points of all routes are in W, shape (3, s) [m]."""
        return route_points(self.plant, self.routes, self.plant_context)

    def box(self) -> tuple[Array, Array]:
        """Lower and upper corner in W of a box around all points of cables and shapes of bodies,
        shape (3,) each [m]."""
        points = [self.points()]
        for body, corners in self._corners:
            X_WB = self.plant.EvalBodyPoseInWorld(self.plant_context, body)
            points.append(X_WB.multiply(corners))
        everything = np.hstack(points)
        return everything.min(axis=1), everything.max(axis=1)

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
        self.publish(time)
        points, first = self.points(), self.routes.first
        curves = [points[:, first[i] : first[i + 1]] for i in range(self.routes.count)]
        slack = np.asarray(tensions <= 0.0)
        self._chains.follow(curves, tensions, slack, time)
        for path, point in zip(self._point_paths(), points.T, strict=True):
            self.meshcat.SetTransform(path, RigidTransform(point), time)
        return slack

    def html(self) -> str:
        """The scene as one page that needs no server."""
        return str(self.meshcat.StaticHtml())

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
    """Corners of a box around each shape that is shown, on its body, shape (3, 8) [m]."""
    corners, inspector = [], scene_graph.model_inspector()
    for geometry in inspector.GetAllGeometryIds(Role.kIllustration):
        box = inspector.GetObbInGeometryFrame(geometry)
        body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
        if box is None or body is None:  # as a half-space, which no window holds
            continue
        X_BG = inspector.GetPoseInFrame(geometry)
        signs = np.array(list(product((-1.0, 1.0), repeat=3))).T
        points = X_BG.multiply(box.pose()).multiply(signs * box.half_width()[:, None])
        corners.append((body, points))
    return corners


def mechanism_picture(mechanism: Mechanism, meshcat: Meshcat) -> MechanismScene:
    """A mechanism at its home, held by its cables, in Meshcat.

    Where no tensions hold it the cables are grey, and `problem` says why.

    Raises:
        RobotFileError: Drake refuses its file.
    """
    scene = MechanismScene(mechanism, meshcat)
    low, high = mechanism.tension_limits()
    try:
        cables = PlantCables(scene.plant, scene.routes, ELASTIC)
        rest = hang(cables, scene.plant_context, lower=low if low > 0.0 else None, upper=high)
        scene.plant.SetPositions(scene.plant_context, rest.positions)
        tensions, full_scale = rest.tensions, 2.0 * max(float(np.max(rest.tensions)), 1e-9)
    except UNHELD as refusal:
        tensions, full_scale = np.full(scene.routes.count, np.nan), 1.0
        scene.problem = str(refusal)
    scene.show_cables(full_scale, *scene.box())
    scene.draw(tensions)
    return scene


def route_points(plant: MultibodyPlant, routes: CableRoutes, context: Context) -> Array:
    """Where the points of all routes are in W, at a context of the plant, shape (3, s) [m]."""
    points = np.empty_like(routes.p_BQ)
    for k, body in enumerate(routes.bodies):
        X_WB = plant.EvalBodyPoseInWorld(context, plant.get_body(BodyIndex(int(body))))
        points[:, k] = X_WB.multiply(routes.p_BQ[:, k])
    return points


def write_mechanism_replay(
    path: Path, mechanism: Mechanism, log: Mapping[str, Array], *, limits: tuple[float, float],
    title: str = "",
) -> None:  # fmt: skip
    """Writes the recording of a run as one HTML file of at most `LARGEST_PAGE`.

    Args:
        path: The file.
        mechanism: The mechanism.
        log: "time", shape (n,) [s], "positions", shape (n, nq), "tensions", shape (n, m) [N].
        limits: Smallest and largest tension that are shown with the tensions [N].
        title: Of the page.
    """
    curves, full_scale = tension_curves(log, limits), float(np.max(log["tensions"]))

    def scene() -> MechanismScene:
        """The mechanism where it starts, in a window that shows it wherever it goes.

        Nothing is drawn yet: what was drawn before a recording has no keys in it.
        """
        scene = MechanismScene(mechanism, open_meshcat())
        corners: list[Array] = []
        for q in log["positions"][sampled_rows(log)][::-1]:
            scene.plant.SetPositions(scene.plant_context, q)
            corners += scene.box()
        scene.show_cables(full_scale, np.min(corners, axis=0), np.max(corners, axis=0))
        return scene

    def html(scene: MechanismScene, **signals: Any) -> str:
        names, exits = scene.routes.names, scene.exits()
        return scene.page(names, exits, full_scale, title=title, **signals)

    def page(most: int) -> tuple[str, int]:
        moving = scene()
        each = BYTES_EACH * (moving.plant.num_bodies() + 2 * moving.routes.p_BQ.shape[1])
        most = min(most, max(FEWEST_FRAMES, LARGEST_PAGE // each))
        shown = frame_indices(log["time"], REPLAY_RATE, most)
        positions, tensions = log["positions"][shown], log["tensions"][shown]
        slack, exits = np.zeros(tensions.shape, bool), []
        moving.start_recording()
        for frame, time in enumerate(log["time"][shown]):
            moving.plant.SetPositions(moving.plant_context, positions[frame])
            slack[frame] = moving.draw(tensions[frame], float(time))
            exits.append(moving.exits().T)
        frames = frame_signals(log, shown, slack)
        frames["places"] = packed(np.array(exits), np.float32)
        moving.plant.SetPositions(moving.plant_context, positions[0])
        return html(moving, frames=frames, curves=curves), len(shown)

    def still() -> str:
        standing = scene()
        standing.draw(log["tensions"][0])
        return html(standing)

    path.write_text(fitting_page(page, still), encoding="utf-8")
