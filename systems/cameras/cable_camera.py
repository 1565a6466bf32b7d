"""A camera in the world that looks at the cables."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from cdpr_drake.arrays import Array
from cdpr_drake.cables.curves import cable_curves
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.vision.cable_images import cable_images
from cdpr_drake.vision.pinhole import Pinhole

CURVE_POINTS = 33
"""Of a hanging cable's curve, from which the points in the image are taken."""

_CABLES_STREAM = 331
"""Tells the noise of this camera from that of others of the same seed."""


class CableCamera(LeafSystem):
    """Projects points of the curves in which cables hang, and adds pixel noise.

    ================== ============== ==== =====================================================
    port               type           unit meaning
    ================== ============== ==== =====================================================
    X_WP               RigidTransform m    in, true pose of the platform
    unstrained_lengths vector(m)      m    in, true lengths
    cable_points       vector(2 m n)  px   out, of each cable u, then v, of n points; NaN: not in
                                           the image
    ================== ============== ==== =====================================================

    A cable is drawn as `curves.cable_curves` has it; a slack one without weight hangs as its length
    does. What hides a cable is not modelled. The image of time t is on the port for who acts at t.
    """

    def __init__(
        self,
        cables: CableSet,
        model: str,
        X_WE: RigidTransform,
        pinhole: Pinhole,
        rate: float,
        *,
        points: int = 15,
        noise: float = 0.0,
        seed: int = 0,
    ) -> None:
        """With the true cables, a name of `cables.CABLE_MODELS`, the camera in W, and images per
        second [Hz]; `points` of each cable are found, with a standard deviation `noise` [px]."""
        super().__init__()
        self._cables, self._model, self._X_WE, self._pinhole = cables, model, X_WE, pinhole
        self._rate, self._count, self._noise, self._seed = rate, points, noise, seed
        self._pose = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._lengths = self.DeclareVectorInputPort("unstrained_lengths", cables.count)
        size = 2 * cables.count * points
        self._points = self.DeclareDiscreteState(np.full(size, np.nan))
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / rate, 0.0, self._take_image)
        ticket = {self.discrete_state_ticket(self._points)}
        self.DeclareVectorOutputPort("cable_points", size, self._calc_points, ticket)

    def look(self, X_WP: Any, lengths: Array, number: int) -> Array:
        """Pixels of an image, shape (2 m n,) [px], of cables at a pose [m] with lengths [m]."""
        curves = cable_curves(self._cables, self._model, X_WP, lengths, CURVE_POINTS)
        random = np.random.default_rng([self._seed, _CABLES_STREAM, number])
        return cable_images(
            curves, self._X_WE, self._pinhole, self._count, self._noise, random
        ).ravel()

    def _take_image(self, context: Context, state: State) -> None:
        number = round(context.get_time() * self._rate)
        seen = self.look(self._pose.Eval(context), self._lengths.Eval(context), number)
        state.get_mutable_discrete_state().get_mutable_vector(self._points).SetFromVector(seen)

    def _calc_points(self, context: Context, output: BasicVector) -> None:
        output.set_value(context.get_discrete_state(self._points).value())
