"""A depth camera: what Drake renders, and what a sensor makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context
from pydrake.systems.sensors import ImageDepth32F

from cdpr_drake.arrays import Array
from cdpr_drake.models.sensor_catalogue import DepthSensorModel
from cdpr_drake.systems.sensors.sampled_sensor import DEPTH, SampledSensor, large_noise
from cdpr_drake.vision.pinhole import Pinhole


class DepthSensor(SampledSensor):
    """Takes depth images at its rate, with noise that may grow with the square of depth.

    ============= ============= ==== ===========================================================
    port          type          unit meaning
    ============= ============= ==== ===========================================================
    rendered      ImageDepth32F m    in, as from the port depth_image_32f of Drake's RgbdSensor
    depth_image   ImageDepth32F m    out, latest image: depth along the optical axis, 0 nearer than
                                     the smallest, inf beyond the largest, as Drake has it
    depth_row     vector(w)     m    out, the row in the middle of that, from left to right
    ============= ============= ==== ===========================================================

    The noise of a pixel is normal, with the standard deviation noise + noise_per_square z^2.

    Source: Khoshelham and Elberink, 2012, for the square.
    """

    def __init__(
        self, model: DepthSensorModel, *, seed: int = 0, rate: float | None = None
    ) -> None:
        """With a type, a seed of the noise, and images per second [Hz]; the type's if None.

        Raises:
            SensorError: The rate is not positive.
        """
        super().__init__(model.width * model.height, model.rate_hz if rate is None else rate)
        self.model, self._seed = model, seed
        w, h = model.width, model.height
        self.DeclareAbstractInputPort("rendered", Value(ImageDepth32F(w, h)))
        ticket = {self.discrete_state_ticket(self._sample)}
        self.DeclareAbstractOutputPort(
            "depth_image", lambda: Value(ImageDepth32F(w, h)), self._calc_image, ticket
        )
        self.DeclareVectorOutputPort("depth_row", w, self._calc_row, ticket)

    def truth(self, context: Context) -> Array:
        """What is rendered now, row by row, shape (h w,) [m]."""
        return np.array(self.get_input_port(0).Eval(context).data, float).ravel()

    def measure(self, truth: Array, number: int) -> Array:
        """The image of now, row by row, shape (h w,) [m]."""
        model = self.model
        deviation = np.where(np.isfinite(truth), truth, 0.0) ** 2 * model.noise_per_square
        deviation += model.noise
        read = truth
        if np.any(deviation > 0.0):
            noise = large_noise(self._seed, DEPTH, number, len(truth))
            read = truth + deviation * noise
        low, high = model.limits
        read = np.where(read > high, np.inf, np.where(read < low, 0.0, read))
        return np.where(truth == 0.0, 0.0, np.where(np.isinf(truth), np.inf, read))

    def reading(self, sample: Array) -> Array:
        """The image of a sample, shape (h, w) [m]."""
        return sample.reshape(self.model.height, self.model.width)

    def image(self, context: Context) -> Array:
        """The latest image, shape (h, w) [m], from this system's own context."""
        return np.array(self.reading(self.sample(context)))

    def _calc_image(self, context: Context, output: AbstractValue) -> None:
        image = output.get_mutable_value()
        image.mutable_data[:, :, 0] = self.reading(self.sample(context))

    def _calc_row(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.reading(self.sample(context))[self.model.height // 2])


def binned(model: DepthSensorModel, pixels: int) -> DepthSensorModel:
    """A camera of the same view whose image has one pixel for each n x n of another."""
    return replace(
        model,
        width=max(model.width // pixels, 1),
        height=max(model.height // pixels, 1),
        focal_length=model.focal_length / pixels,
    )


def depth_pinhole(model: DepthSensorModel) -> Pinhole:
    """Its intrinsic parameters, the principal point in the middle of the image."""
    return Pinhole(
        model.width, model.height, model.focal_length, model.focal_length,
        0.5 * (model.width - 1), 0.5 * (model.height - 1),
    )  # fmt: skip
