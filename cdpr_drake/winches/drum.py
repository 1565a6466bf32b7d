"""The drum of a winch: how much cable it holds at an angle, with layers upon layers.

The drum is wound in layers of N turns. Within a layer the cable lies at a constant radius; over
the last turn of a layer it climbs to the next one, and its radius grows in proportion to the angle.
With N = 1 that is a spiral, with N infinite a drum of constant radius. The radius is a continuous
function of the angle phi at which the drum stands, and the wound length w, dw/dphi = r(phi), has a
closed form, as has its inverse. An empty drum is phi = 0, w = 0; below, the first radius continues.

Arrays may hold AutoDiffXd.

Source: servoing thesis (1.1), which names the layers without a law for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cdpr_drake.arrays import Array

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Drum:
    """A drum behind a gear; all drums of a robot are alike but for the cables on them.

    Attributes:
        radius: Of the cable's centre line in the first layer, drum's radius plus half of the
            cable's diameter [m]; cables of several diameters: one for each, shape (m,).
        gear_ratio: Motor turns per drum turn.
        layer_turns: N, turns in a layer; infinite: one layer.
        layer_height: By how much the radius grows from layer to layer [m]; or shape (m,).
        wound: Cable on the drum where the motor's angle is zero [m]; or shape (m,).
    """

    radius: float | Array
    gear_ratio: float
    layer_turns: float = np.inf
    layer_height: float | Array = 0.0
    wound: float | Array = 0.0

    def has_layers(self) -> bool:
        """Whether the radius changes at all."""
        return self._has_layers

    @cached_property
    def _has_layers(self) -> bool:
        return bool(np.isfinite(self.layer_turns)) and bool(np.any(self.layer_height))

    def radii(self, m: int) -> Array:
        """Radius over gear ratio in the first layer, one for each of m cables [m/rad]."""
        return np.full(m, self.radius) / self.gear_ratio

    def start_angle(self) -> float | Array:
        """Angle phi of the drum where the motor's angle is zero [rad], or one for each cable."""
        return self._start

    @cached_property
    def _start(self) -> float | Array:
        angle = drum_angle(self, np.array(self.wound))
        return float(angle) if angle.ndim == 0 else angle

    def paid_out(self, motor_angles: Array) -> Array:
        """Cable that left the drum since the motor stood at zero, from (m,) [rad] to (m,) [m].

        A positive angle pays out: l = l_0 + `paid_out(q)`.
        """
        phi = self.start_angle() - motor_angles / self.gear_ratio
        return np.asarray(self.wound - wound_length(self, phi))

    def per_radius(self, motor_angles: Array) -> Array:
        """How `paid_out` grows with the drums' radii, from (..., m) [rad] to (..., m) [-].

        What is wound is the integral of the radius over the angle at which the drum stands, which
        begins where a drum of that radius holds what is wound at zero.
        """
        start = self.start_angle()
        phi = start - motor_angles / self.gear_ratio
        at_start = drum_radius(self, np.asarray(start))
        return np.asarray(start * drum_radius(self, phi) / at_start - phi)

    def length_per_angle(self, motor_angles: Array) -> Array:
        """dl/dq, the radius over the gear ratio at these motor angles, shape (m,) [m/rad]."""
        phi = self.start_angle() - motor_angles / self.gear_ratio
        return np.asarray(drum_radius(self, phi) / self.gear_ratio)

    def turning(self, paid_out: Array) -> tuple[Array, Array]:
        """dl/dq [m/rad] and d2l/dq2 [m/rad^2] where this much is paid out, from (m,) [m]."""
        phi = drum_angle(self, self.wound - paid_out)
        first = drum_radius(self, phi) / self.gear_ratio
        if not self.has_layers():
            return np.asarray(first), 0.0 * phi
        _, beyond = _in_layer(self, phi)
        climbing = np.where(beyond > 0.0, 1.0, 0.0)
        return np.asarray(first), -self.layer_height / TURN / self.gear_ratio**2 * climbing

    def motor_angles(self, paid_out: Array) -> Array:
        """Inverse of `paid_out`, from (m,) [m] to (m,) [rad]."""
        phi = drum_angle(self, self.wound - np.asarray(paid_out))
        return np.asarray((self.start_angle() - phi) * self.gear_ratio)


def drum_radius(drum: Drum, phi: Array) -> Array:
    """Radius r at which the cable leaves the drum, from phi [rad], any shape, to [m]."""
    if not drum.has_layers():
        return drum.radius + 0.0 * phi
    layer, beyond = _in_layer(drum, phi)
    return np.asarray(drum.radius + drum.layer_height * (layer + np.maximum(beyond, 0.0) / TURN))


def wound_length(drum: Drum, phi: Array) -> Array:
    """Cable on the drum, w, the integral of r, from phi [rad], any shape, to [m]."""
    if not drum.has_layers():
        return np.asarray(drum.radius * phi)
    layer, beyond = _in_layer(drum, phi)
    flat = (drum.layer_turns - 1.0) * TURN
    climb = np.maximum(beyond, 0.0)
    here = (drum.radius + drum.layer_height * layer) * (flat + beyond)
    return np.asarray(_below(drum, layer) + here + drum.layer_height * climb**2 / (2.0 * TURN))


def drum_angle(drum: Drum, wound: Array) -> Array:
    """Inverse of `wound_length`, from w [m], any shape, to phi [rad]."""
    if not drum.has_layers():
        return np.asarray(wound / drum.radius)
    h, whole = drum.layer_height, drum.layer_turns * TURN
    # Full layers: the largest whole k with a k^2 + b k <= w.
    a = 0.5 * h * whole
    b = whole * drum.radius - a + 0.5 * h * TURN
    held = np.maximum(wound, 0.0 * wound)
    layer = np.floor(2.0 * held / (b + np.sqrt(b * b + 4.0 * a * held)))
    radius = drum.radius + h * layer
    flat = (drum.layer_turns - 1.0) * TURN
    rest = wound - _below(drum, layer)
    # r v + h v^2 / (4 pi) = rest - r flat for the climb v.
    excess = np.maximum(rest - radius * flat, 0.0 * rest)
    climb = 2.0 * excess / (radius + np.sqrt(radius**2 + 2.0 * h / TURN * excess))
    return np.asarray(layer * whole + np.minimum(rest / radius, flat) + climb)


def _in_layer(drum: Drum, phi: Array) -> tuple[Array, Array]:
    """Full layers below, and how far the angle is beyond where the climb begins [rad]."""
    whole = drum.layer_turns * TURN
    layer = np.maximum(np.floor(phi / whole), 0.0)
    return layer, phi - layer * whole - (drum.layer_turns - 1.0) * TURN


def _below(drum: Drum, layer: Array) -> Array:
    """Cable in that many full layers [m]."""
    h, whole = drum.layer_height, drum.layer_turns * TURN
    a = 0.5 * h * whole
    return np.asarray(layer * (a * layer + whole * drum.radius - a + 0.5 * h * TURN))
