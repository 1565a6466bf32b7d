"""The object that the camera looks at, as a part of the scene that may move by itself."""

from __future__ import annotations

from collections.abc import Sequence

from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FramePoseVector, GeometryFrame, SceneGraph
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, LeafSystem

from cdpr_drake.models.scene import plate_geometry
from cdpr_drake.trajectories.pose_trajectory import MovingPose
from cdpr_drake.vision.target import Plate

NAME = "target"


class SceneTarget(LeafSystem):
    """Moves an object along its path and shows it; nothing acts on it.

    ============= =============== ==== ======================================
    port          type            unit meaning
    ============= =============== ==== ======================================
    X_WO          RigidTransform  m    out, pose of the object in W
    geometry_pose FramePoseVector m    out, the same, for the scene graph
    ============= =============== ==== ======================================
    """

    def __init__(
        self, scene_graph: SceneGraph, plates: Sequence[Plate], motion: MovingPose
    ) -> None:
        """Registers the object's plates with the scene graph."""
        super().__init__()
        self._motion = motion
        self.source_id = scene_graph.RegisterSource(NAME)
        self._frame = scene_graph.RegisterFrame(self.source_id, GeometryFrame(NAME))
        for number, plate in enumerate(plates):
            instance = plate_geometry(plate, RigidTransform(), f"{NAME}_{number}")
            scene_graph.RegisterGeometry(self.source_id, self._frame, instance)
        ticket = {self.time_ticket() if motion.is_moving() else self.nothing_ticket()}
        self.DeclareAbstractOutputPort(
            "X_WO", lambda: Value(RigidTransform()), self._calc_pose, ticket
        )
        self.DeclareAbstractOutputPort(
            "geometry_pose", lambda: Value(FramePoseVector()), self._calc_frame, ticket
        )

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._motion.at(context.get_time()))

    def _calc_frame(self, context: Context, output: AbstractValue) -> None:
        poses = FramePoseVector()
        poses.set_value(self._frame, self._motion.at(context.get_time()))
        output.set_value(poses)
