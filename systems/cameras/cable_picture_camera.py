"""A camera in the world that draws the robot with its cables, and finds the cables in the image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import DepthRange, DepthRenderCamera, FrameId, QueryObject
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from cdpr_drake.arrays import Array
from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.errors import CableGeometryError
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.rendered_camera import FAR, NEAR, color_camera
from cdpr_drake.systems.cameras.scene_picture import draw_image
from cdpr_drake.vision.cable_detection import SeenSags, SightSettings, find_sags
from cdpr_drake.vision.cable_pictures import draw_cables
from cdpr_drake.vision.pinhole import Pinhole

CURVE_POINTS = 65
"""Of a hanging cable's curve as it is drawn."""

_GRAIN_STREAM = 337
"""Tells the noise of these images from that of others of the same seed."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CablePicture:
    """How a camera in the world draws cables.

    Attributes:
        cables: The true cables.
        model: A name of `cables.CABLE_MODELS`.
        radii: Of the cables, shape (m,) [m].
        world: Geometry frame of the world.
        X_WE: Pose of the camera, z forward, y down [m].
        pinhole: Its intrinsic parameters; without a lens.
        grain: Standard deviation of every colour of a pixel, of 255.
        seed: Of that.
    """

    cables: CableSet
    model: str
    radii: Array
    world: FrameId
    X_WE: RigidTransform
    pinhole: Pinhole
    grain: float = 0.0
    seed: int = 0

    def draw(
        self, query: QueryObject, X_WP: RigidTransform, lengths: Array, number: int
    ) -> np.ndarray:
        """The image of a scene with cables, shape (height, width, 3), 8 bits a channel.

        Args:
            query: The scene, with the renderer of `add_renderer`.
            X_WP: True pose of the platform in it [m].
            lengths: True unstrained lengths, shape (m,) [m].
            number: Of the image, for its grain.
        """
        scene = draw_image(query, self.world, self.X_WE, self.pinhole)
        depth = query.RenderDepthImage(
            DepthRenderCamera(color_camera(self.pinhole).core(), DepthRange(NEAR, 0.9 * FAR)),
            self.world,
            self.X_WE,
        ).data[:, :, 0]
        curves = cable_curves(self.cables, self.model, X_WP, lengths, CURVE_POINTS)
        drawn = draw_cables(scene, depth, curves, self.radii, self.X_WE, self.pinhole)
        if self.grain == 0.0:
            return drawn
        random = np.random.default_rng([self.seed, _GRAIN_STREAM, number])
        grainy = drawn + self.grain * random.standard_normal(drawn.shape)
        return np.asarray(np.clip(np.round(grainy), 0.0, 255.0), np.uint8)


class CablePictureCamera(LeafSystem):
    """Draws cables as they hang, and finds in the image how much longer they are than their ways.

    ================== ============== ==== ====================================================
    port               type           unit meaning
    ================== ============== ==== ====================================================
    query_object       QueryObject    -    in, of a scene graph with the renderer of
                                           `add_renderer`
    X_WP               RigidTransform m    in, true pose of the platform
    unstrained_lengths vector(m)      m    in, true lengths
    X_WP_believed      RigidTransform m    in, pose from which it is reckoned where cables end
    cable_surplus      vector(2 m)    m    out, surplus lengths, then their standard deviations;
                                           NaN: the cable is not seen well enough
    ================== ============== ==== ====================================================

    The image of time t is on the port for who acts at t. By `vision.cable_detection.find_sags`.
    """

    def __init__(
        self, picture: CablePicture, believed: CableSet, rate: float, settings: SightSettings
    ) -> None:
        """With the picture, the cables as believed, images per second [Hz] and how it looks."""
        super().__init__()
        self._picture, self._believed = picture, believed
        self._rate, self._settings = rate, settings
        m = believed.count
        query = AbstractValue.Make(QueryObject())
        self._query = self.DeclareAbstractInputPort("query_object", query)
        self._pose = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._lengths = self.DeclareVectorInputPort("unstrained_lengths", m)
        self._told = self.DeclareAbstractInputPort("X_WP_believed", Value(RigidTransform()))
        self._found = self.DeclareDiscreteState(np.full(2 * m, np.nan))
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / rate, 0.0, self._take_image)
        ticket = {self.discrete_state_ticket(self._found)}
        self.DeclareVectorOutputPort("cable_surplus", 2 * m, self._calc, ticket)

    def image(self, context: Context) -> np.ndarray:
        """The image of now, from this system's own context."""
        return self._picture.draw(
            self._query.Eval(context),
            self._pose.Eval(context),
            self._lengths.Eval(context),
            round(context.get_time() * self._rate),
        )

    def look(self, context: Context) -> SeenSags | None:
        """What is found in the image of now; None: no cable can run at the believed pose."""
        X_WP = self._told.Eval(context)
        try:
            return find_sags(
                self.image(context), self._believed, X_WP, self._picture.X_WE,
                self._picture.pinhole, self._settings,
            )  # fmt: skip
        except CableGeometryError:
            return None

    def _take_image(self, context: Context, state: State) -> None:
        seen = self.look(context)
        values = np.full(2 * self._believed.count, np.nan)
        if seen is not None:
            values = np.concatenate([seen.surplus, seen.surplus_sigma])
        state.get_mutable_discrete_state().get_mutable_vector(self._found).SetFromVector(values)

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.set_value(context.get_discrete_state(self._found).value())
