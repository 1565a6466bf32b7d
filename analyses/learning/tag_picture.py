"""Images of a tag, rendered by Drake, from any pose of the camera."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import QueryObject, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.models.rendered_camera import add_renderer, check_rendering
from cdpr_drake.models.scene import add_tag
from cdpr_drake.systems.cameras.scene_picture import draw_image
from cdpr_drake.vision.pinhole import Pinhole


class TagPicture:
    """A scene with nothing but a tag in it.

    Attributes:
        shape: Of an image: height, width, 3.
        pinhole: The camera.
    """

    def __init__(self, edge: float, pinhole: Pinhole) -> None:
        """For a tag of an edge [m] and a camera.

        Raises:
            RenderingError: This machine cannot render.
        """
        check_rendering()
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        add_renderer(scene_graph)
        add_tag(plant, 0, edge, RigidTransform())
        plant.Finalize()
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._scene: SceneGraph = scene_graph
        self._frame = scene_graph.world_frame_id()
        self.pinhole = pinhole
        self.shape = (pinhole.height, pinhole.width, 3)

    def draw(self, X_OC: RigidTransform) -> np.ndarray:
        """The image from a pose of the camera in the tag's frame [m], of `shape`, 8 bits."""
        port = self._scene.get_query_output_port()
        query: QueryObject = port.Eval(self._scene.GetMyContextFromRoot(self._context))
        image = draw_image(query, self._frame, X_OC, self.pinhole)
        return np.ascontiguousarray(image[:, :, :3])
