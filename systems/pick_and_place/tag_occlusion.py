"""A plate that hides a tag for a while."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import (
    Box,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakePhongIllustrationProperties,
    PerceptionProperties,
    Rgba,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

NAME = "tag_occlusion"
COVER_COLOR = np.array([0.25, 0.55, 0.35, 1.0])

ABOVE = 4e-3
"""Height of the plate above the tag that it hides [m]."""

AWAY = RigidTransform([0.0, 0.0, -10.0])
"""Where it is while it hides nothing [m]."""

OVERLAP = 1.6
"""Edge of the plate per edge of the tag's black square; the white rim is 1.25."""


def cover_plate(size: float) -> tuple[Box, RigidTransform]:
    """The plate over a tag of a size, and its pose in the tag's frame [m]."""
    edge = OVERLAP * size
    return Box(edge, edge, 1e-3), RigidTransform([0.0, 0.0, ABOVE])


class TagOcclusion(LeafSystem):
    """Lies above a tag from a while after a phase began, for a time.

    ============= =============== ==== ==================================================
    port          type            unit meaning
    ============= =============== ==== ==================================================
    phase         vector(2)       -, s in, number of the phase, and when it began
    X_WT          RigidTransform  m    in, true pose of the tag
    tag_occluded  vector(1)       -    out, 1 while the tag is hidden
    geometry_pose FramePoseVector m    out, of the plate, for the scene graph
    ============= =============== ==== ==================================================

    Once over the tag it stays for the whole time, also where the phase ends before. It touches
    nothing.
    """

    def __init__(
        self, scene_graph: SceneGraph, size: float, phase: int, delay: float, duration: float
    ) -> None:
        """Registers a plate for a tag of a size [m]; times in seconds."""
        super().__init__()
        self._number, self._delay, self._duration = phase, delay, duration
        self._began = self.DeclareDiscreteState(np.array([-1.0]))
        self._phase = self.DeclareVectorInputPort("phase", 2)
        self._tag = self.DeclareAbstractInputPort("X_WT", Value(RigidTransform()))
        self.source_id = scene_graph.RegisterSource(NAME)
        self._frame = scene_graph.RegisterFrame(self.source_id, GeometryFrame(NAME))
        shape, self._X_TPlate = cover_plate(size)
        plate = GeometryInstance(RigidTransform(), shape, NAME)
        plate.set_illustration_properties(MakePhongIllustrationProperties(COVER_COLOR))
        seen = PerceptionProperties()
        seen.AddProperty("phong", "diffuse", Rgba(*COVER_COLOR))
        plate.set_perception_properties(seen)
        scene_graph.RegisterGeometry(self.source_id, self._frame, plate)
        self.DeclarePeriodicDiscreteUpdateEvent(0.01, 0.0, self._update)
        self.DeclareVectorOutputPort("tag_occluded", 1, self._calc_hidden)
        self.DeclareAbstractOutputPort(
            "geometry_pose", lambda: Value(FramePoseVector()), self._calc_pose
        )

    def _update(self, context: Context, values: DiscreteValues) -> None:
        """Remembers when the phase began, once."""
        number, began = self._phase.Eval(context)
        first = context.get_discrete_state(self._began).value()[0] < 0.0
        if first and int(number) == self._number:
            values.set_value(self._began, [began])

    def hides(self, context: Context) -> bool:
        """Whether the tag is hidden, from this block's own context."""
        began = context.get_discrete_state(self._began).value()[0]
        passed = context.get_time() - began - self._delay
        return bool(began >= 0.0 and 0.0 <= passed < self._duration)

    def _calc_hidden(self, context: Context, output: BasicVector) -> None:
        output.set_value([float(self.hides(context))])

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        poses, pose = FramePoseVector(), AWAY
        if self.hides(context):
            pose = self._tag.Eval(context) @ self._X_TPlate
        poses.set_value(self._frame, pose)
        output.set_value(poses)
