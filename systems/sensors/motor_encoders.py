"""Encoders on the motors, and the cable lengths that a controller computes from them."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.sensor_noise import encoder_readings
from cdpr_drake.models.sensor_catalogue import EncoderModel
from cdpr_drake.systems.sensors.sampled_sensor import SampledSensor
from cdpr_drake.winches.drum import Drum
from cdpr_drake.winches.groups import WinchGroups


class MotorEncoders(SampledSensor):
    """Counts the motors' turns through gears and drums.

    ================== ========= ==== =========================================================
    port               type      unit meaning
    ================== ========= ==== =========================================================
    unstrained_lengths vector(m) m    in, true ones, from the winches
    motor_angles       vector(m) rad  out, latest whole counts, positive paid out, zero where
                                      the lengths are the reference
    measured_lengths   vector(m) m    out, unstrained lengths that follow by the believed drum
    ================== ========= ==== =========================================================

    What an encoder cannot see: the stretch of the cable, and a wrong drum or reference. Of several
    cables on one winch it sees the first; the others are taken to be paid out as much.

    Source: servoing thesis (1.1).
    """

    def __init__(
        self,
        model: EncoderModel,
        drum: Drum,
        reference: Array,
        believed_drum: Drum | None = None,
        rate: float | None = None,
        groups: WinchGroups | None = None,
    ) -> None:
        """With encoders of a type on the winches of m cables.

        Args:
            model: The type.
            drum: The true drum.
            reference: Unstrained lengths where the motors' angles are zero, shape (m,) [m].
            believed_drum: The drum as the controller computes with it; the true one if None.
            rate: Readings per second [Hz]; those of the type if None.
            groups: Which cables are on one winch, whose one encoder tells of all of them; None:
                each is on a winch of its own.

        Raises:
            SensorError: The rate is not positive.
        """
        m = len(reference)
        super().__init__(2 * m, model.rate_hz if rate is None else rate)
        self._counts = model.counts_per_turn
        self._drum, self._believed = drum, believed_drum or drum
        self._reference = np.asarray(reference, float).copy()
        self._m = m
        self._leaders = list(groups.leaders() if groups else range(m))
        self.DeclareVectorInputPort("unstrained_lengths", m)
        self._declare_slice("motor_angles", 0, m)
        self._declare_slice("measured_lengths", m, m)

    def measure(self, truth: Array, number: int) -> Array:
        """Motor angles [rad] and cable lengths [m] of now, shape (2 m,)."""
        paid_out = truth - self._reference
        turned = self._drum.motor_angles(paid_out)[self._leaders]
        angles = encoder_readings(turned, self._counts)
        lengths = self._reference + self._believed.paid_out(angles)
        return np.concatenate([angles, lengths])

    def _per_turn(self) -> int:
        return self._m

    def reading(self, sample: Array) -> Array:
        """The lengths of a sample, shape (m,) [m]."""
        return sample[self._m :]
