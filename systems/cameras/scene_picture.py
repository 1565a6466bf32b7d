"""Draws windows of images, and of whole images only what has something in it.

A renderer without a graphics card takes about as long for a pixel of the background as for any
other: all are smoothed, in a pass of their own. What no geometry's bounding box reaches is
background, which is filled in.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import product

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, QueryObject, Role
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems.framework import Context, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import exponential
from cdpr_drake.models.rendered_camera import BACKGROUND, NEAR, color_camera
from cdpr_drake.vision.image_flaws import ImageFlaws
from cdpr_drake.vision.image_window import (
    ImageWindow,
    union,
    whole_image,
    window_round,
    with_principal_point,
)
from cdpr_drake.vision.lens_picture import lens_picture, without_lens
from cdpr_drake.vision.pinhole import Pinhole

SMOOTHED = 4
"""Pixels round a bounding box that smoothing of its edges may reach."""

_IMAGE_STREAM = 577
"""Tells the noise of images from other random numbers of the same seed."""

_SIGNS = np.array(list(product((-1.0, 1.0), repeat=3))).T
_EDGES = np.array(
    [(i, j) for i, j in product(range(8), repeat=2) if (i ^ j) in (1, 2, 4) and i < j]
).T
_FILLING = np.round(255.0 * np.append(BACKGROUND, 1.0)).astype(np.uint8)


@dataclass(frozen=True, kw_only=True)
class SpoiledImages:
    """What spoils the images of a camera, and whose motion while they are exposed.

    Attributes:
        flaws: What spoils them.
        rate: Images per second [Hz].
        seed: Seed of the noise, with the image's number.
        frame: Geometry frame of the platform, P.
        body: Its place among the plant's bodies.
    """

    flaws: ImageFlaws
    rate: float
    seed: int
    frame: FrameId
    body: int


class SceneCamera(LeafSystem):
    """A camera of a scene: the image of Drake's RgbdSensor, drawn where there is something.

    =============== ===================== ===== ==================================================
    port            type                  unit  meaning
    =============== ===================== ===== ==================================================
    query_object    QueryObject           -     in, of a scene graph with the renderer of
                                                `add_renderer`
    body_velocities list[SpatialVelocity] rad/s in, of all bodies in W, as MultibodyPlant gives
                                          m/s   them; only if images take time
    X_BC            RigidTransform        m     in, pose of the camera on B; only if it turns
    color_image     ImageRgba8U           -     out
    =============== ===================== ===== ==================================================

    Through a lens it is drawn wider and looked up, see `vision.lens_picture`. An image that takes
    time is drawn several times, from where the camera was with the platform's twist of now: that is
    exact while the twist is constant, for what rests in the world before a camera on the platform,
    and for what is on the platform before one in the world. The image of time t is complete at t.
    """

    def __init__(
        self,
        parent: FrameId,
        X_BC: RigidTransform,
        pinhole: Pinhole,
        spoiled: SpoiledImages | None = None,
        turns: bool = False,
    ) -> None:
        """For a camera on a body B.

        Args:
            parent: Geometry frame of B.
            X_BC: Pose of the camera frame C in B, z forward, y down [m].
            pinhole: Intrinsic parameters [px] and lens.
            spoiled: What spoils its images; None: nothing.
            turns: Whether an input says where it is on B; it rests there while an image is exposed.

        Raises:
            LensDistortionError: The lens has no valid field in all of the image.
        """
        super().__init__()
        self._parent, self._X_BC, self._pinhole = parent, X_BC, pinhole
        self._spoiled, self._drawn = spoiled, without_lens(pinhole)
        if spoiled is not None and spoiled.flaws.moves:
            self._velocities = self.DeclareAbstractInputPort(
                "body_velocities", Value[list[SpatialVelocity]]()
            )
        query = AbstractValue.Make(QueryObject())
        self._query = self.DeclareAbstractInputPort("query_object", query)
        self._turned = None
        if turns:
            self._turned = self.DeclareAbstractInputPort("X_BC", Value(RigidTransform()))
        self.DeclareAbstractOutputPort(
            "color_image",
            lambda: Value(ImageRgba8U(pinhole.width, pinhole.height)),
            self._calc_image,
        )

    def _calc_image(self, context: Context, output: AbstractValue) -> None:
        query, spoiled = self._query.Eval(context), self._spoiled
        X_BC = self._X_BC if self._turned is None else self._turned.Eval(context)
        if spoiled is None:
            output.get_mutable_value().mutable_data[:] = self._seen(query, X_BC)
            return
        flaws, places = spoiled.flaws, [X_BC]
        if flaws.moves:
            V_WP = self._velocities.Eval(context)[spoiled.body]
            places = self._places(query, V_WP, flaws.instants, X_BC)
        image = flaws.expose(np.array([self._seen(query, place) for place in places]))
        number = round(context.get_time() * spoiled.rate)
        random = np.random.default_rng([spoiled.seed, _IMAGE_STREAM, number])
        output.get_mutable_value().mutable_data[:] = flaws.spoil(image, random)

    def _seen(self, query: QueryObject, X_BC: RigidTransform) -> np.ndarray:
        """The image from a place on B, through the lens."""
        drawn = draw_image(query, self._parent, X_BC, self._drawn)
        return drawn if self._pinhole.distortion is None else lens_picture(drawn, self._pinhole)

    def _places(
        self, query: QueryObject, V_WP: SpatialVelocity, instants: Array, X_BC: RigidTransform
    ) -> list[RigidTransform]:
        """Poses in B from which the scene of now looks as it did before, at instants [s], from
        where the camera was then."""
        assert self._spoiled is not None
        X_WP = query.GetPoseInWorld(self._spoiled.frame)
        R_PW = X_WP.rotation().inverse()
        V_P = np.concatenate([R_PW @ V_WP.rotational(), R_PW @ V_WP.translational()])
        if self._parent == self._spoiled.frame:
            return [exponential(V_P * t) @ X_BC for t in instants]
        X_PB = X_WP.inverse() @ query.GetPoseInWorld(self._parent)
        return [X_PB.inverse() @ exponential(-V_P * t) @ X_PB @ X_BC for t in instants]


def draw_window(
    query: QueryObject,
    parent: FrameId,
    X_BC: RigidTransform,
    camera: Pinhole,
    window: ImageWindow,
) -> np.ndarray:
    """A window of a camera's image, shape (height, width, 4), 8 bits a channel.

    Drake draws windows only that have the principal point inside, so what is drawn may be larger
    than what is wanted.

    Args:
        query: The scene, with the renderer of `add_renderer`.
        parent: Geometry frame of the body B that carries the camera.
        X_BC: Pose of the camera frame C in B, z forward, y down [m].
        camera: Intrinsic parameters of the whole camera [px].
        window: What of its image is wanted.
    """
    drawn = with_principal_point(window, camera)
    image = query.RenderColorImage(color_camera(drawn.pinhole(camera)), parent, X_BC)
    return window.cut(image.data, drawn)


def draw_image(
    query: QueryObject, parent: FrameId, X_BC: RigidTransform, camera: Pinhole
) -> np.ndarray:
    """A camera's whole image, shape (height, width, 4), 8 bits a channel; as `draw_window`."""
    everything = whole_image(camera)
    used = occupied_window(query, RigidTransform(query.GetPoseInWorld(parent)) @ X_BC, camera)
    if used == everything:
        return draw_window(query, parent, X_BC, camera, everything)
    picture = _background(everything)
    if used is not None:
        part = draw_window(query, parent, X_BC, camera, used)
        picture[used.v : used.v + used.height, used.u : used.u + used.width] = part
    return picture


def occupied_window(
    query: QueryObject, X_WC: RigidTransform, camera: Pinhole
) -> ImageWindow | None:
    """The part of an image that has all geometries in it; None where there are none.

    It may be larger than needed, never smaller.

    Args:
        query: The scene.
        X_WC: Pose of the camera frame [m].
        camera: Intrinsic parameters.
    """
    everything, inspector = whole_image(camera), query.inspector()
    bounds = [query.ComputeObbInWorld(k) for k in inspector.GetAllGeometryIds(Role.kPerception)]
    if not bounds:
        return None
    if None in bounds:  # a half space
        return everything
    halves = np.array([bound.half_width() for bound in bounds])
    R_W = np.array([bound.pose().rotation().matrix() for bound in bounds])
    p_W = np.array([bound.center() for bound in bounds])
    R_CW = X_WC.rotation().matrix().T
    turned = (R_CW @ R_W) @ (_SIGNS * halves[:, :, np.newaxis])
    corners = turned + (R_CW @ (p_W - X_WC.translation()).T).T[:, :, np.newaxis]
    boxes = [box for box in _boxes_of(corners, camera) if np.all(np.isfinite(box))]
    parts = [window_round(box, SMOOTHED, everything) for box in boxes]
    seen = [part for part in parts if part is not None]
    return reduce(union, seen) if seen else None


def _boxes_of(p_CK: Array, camera: Pinhole) -> Array:
    """Least and largest (u, v) of what a camera sees of boxes, shape (n, 4) [px].

    NaN for those that are nearer than what is drawn.

    Args:
        p_CK: Corners in the camera, shape (n, 3, 8) [m].
        camera: Intrinsic parameters.
    """
    begin, end = p_CK[:, :, _EDGES[0]], p_CK[:, :, _EDGES[1]]
    cut = (begin[:, 2] >= NEAR) != (end[:, 2] >= NEAR)
    rise = np.where(cut, end[:, 2] - begin[:, 2], 1.0)
    share = np.where(cut, (NEAR - begin[:, 2]) / rise, np.nan)
    crossings = begin + share[:, np.newaxis] * (end - begin)
    drawn = np.where(p_CK[:, 2:] >= NEAR, p_CK, np.nan)
    points = np.concatenate([drawn, crossings], axis=2)
    uv = camera.project(np.moveaxis(points, 1, 0).reshape(3, -1)).reshape(2, len(p_CK), -1)
    least = np.min(uv, axis=2, where=np.isfinite(uv), initial=np.inf)
    most = np.max(uv, axis=2, where=np.isfinite(uv), initial=-np.inf)
    boxes = np.concatenate([least, most]).T
    return np.where(np.isfinite(boxes), boxes, np.nan)


def _background(window: ImageWindow) -> np.ndarray:
    """A picture of nothing, shape (height, width, 4), 8 bits a channel."""
    pixels = np.full((window.height, window.width), _FILLING.view(np.uint32)[0])
    return pixels.view(np.uint8).reshape(window.height, window.width, 4)
