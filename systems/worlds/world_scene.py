"""The bodies of a world as a part of the scene that pictures are made of."""

from __future__ import annotations

from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import (
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    IllustrationProperties,
    MakePhongIllustrationProperties,
    PerceptionProperties,
    Rgba,
    SceneGraph,
)
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem

from cdpr_drake.systems.worlds.model_files import Part
from cdpr_drake.systems.worlds.world import World, WorldBody

NAME = "world"


class WorldScene(LeafSystem):
    """Shows the bodies of a world where they are; nothing touches what it shows.

    ============= =============== ==== ================================================
    port          type            unit meaning
    ============= =============== ==== ================================================
    geometry_pose FramePoseVector m    out, of the bodies that move, for the scene graph
    ============= =============== ==== ================================================

    Bodies that rest are fixed to W.
    """

    def __init__(self, scene_graph: SceneGraph, world: World) -> None:
        """Registers the shapes of a world with the scene graph."""
        super().__init__()
        self.source_id = scene_graph.RegisterSource(NAME)
        self._moving: list[tuple[FrameId, WorldBody]] = []
        for body in world.bodies:
            frame = None
            if body.motion.is_moving():
                frame = scene_graph.RegisterFrame(self.source_id, GeometryFrame(body.name))
                self._moving.append((frame, body))
            for number, part in enumerate(part for part in body.parts if part.shown):
                name = f"{body.name}_{number}" if number else body.name
                if frame is not None:
                    instance = _instance(part, part.X_BG, name)
                    scene_graph.RegisterGeometry(self.source_id, frame, instance)
                    continue
                X_WG = body.motion.at(0.0) @ part.X_BG
                scene_graph.RegisterAnchoredGeometry(
                    self.source_id, _instance(part, X_WG, f"{NAME}_{name}")
                )
        ticket = {self.time_ticket() if self._moving else self.nothing_ticket()}
        self.DeclareAbstractOutputPort(
            "geometry_pose", lambda: Value(FramePoseVector()), self._calc, ticket
        )

    def _calc(self, context: Context, output: AbstractValue) -> None:
        poses, time = FramePoseVector(), context.get_time()
        for frame, body in self._moving:
            poses.set_value(frame, body.motion.at(time))
        output.set_value(poses)


def add_world_scene(builder: DiagramBuilder, scene_graph: SceneGraph, world: World) -> WorldScene:
    """Adds what shows a world to a builder, and connects it to the scene graph there."""
    scene = builder.AddNamedSystem(NAME, WorldScene(scene_graph, world))
    builder.Connect(
        scene.GetOutputPort("geometry_pose"), scene_graph.get_source_pose_port(scene.source_id)
    )
    return scene


def _instance(part: Part, X_FG: object, name: str) -> GeometryInstance:
    instance = GeometryInstance(X_FG, part.shape, name)
    seen, shown = PerceptionProperties(), IllustrationProperties()
    if part.color is not None:  # else its file has colours, which Drake would say that it keeps
        shown = MakePhongIllustrationProperties(part.color)
        seen.AddProperty("phong", "diffuse", Rgba(*part.color))
    instance.set_illustration_properties(shown)
    instance.set_perception_properties(seen)
    return instance
