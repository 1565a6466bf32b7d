"""Friction in what a platform hangs on, by Dahl: small turns bend contacts, large ones slip them.

Where cables are tied to a platform, wire ropes bend and joints turn with friction, and wires that
hang on it rub in themselves. With z how far the contacts are bent, in P, and w the platform's
angular velocity there,

    M = -K z,    dz/dt = w - |w| z / a,    |z| <= a,

so that small turns meet a spring K, and large ones the moment K a. From unbent contacts, turned by
s one way, z = a (1 - exp(-s / a)); between turns of +-A for long, z = +-a tanh(A / a) at their
ends, and each swing there and back takes the energy 4 K a (A - a tanh(A / a)). What is taken at
every instant is K z^2 |w| / a.

Off is K = 0: a robot without has no such state.

Source: Dahl, A solid friction model, 1968; that of Bouc and Wen with n = 1 along one direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.platform_joint import PlatformJoint


@dataclass(frozen=True, kw_only=True)
class ContactHysteresis:
    """Friction against turns of a platform.

    Attributes:
        tilt: K about x and y of P [N m/rad].
        turn: K about z of P [N m/rad].
        slip: a, the turn at which contacts slip [rad].
    """

    tilt: float
    turn: float
    slip: float

    def is_there(self) -> bool:
        """Whether any turn is rubbed against."""
        return self.tilt > 0.0 or self.turn > 0.0

    def stiffness(self) -> Array:
        """K about the axes of P, shape (3,) [N m/rad]."""
        return np.array([self.tilt, self.tilt, self.turn])

    def held_moments(self) -> Array:
        """Largest moments K a about the axes of P, shape (3,) [N m]."""
        return np.asarray(self.slip * self.stiffness())

    def along(self, joint: PlatformJoint) -> Array:
        """K of the turns that a platform has, shape (3,) in P, or (1,) about a plane's normal.

        Args:
            joint: What it moves by; on a line there are none, shape (0,).
        """
        if joint.is_floating:
            return self.stiffness()
        normal = joint.R_PM.matrix()[:, 2]
        return np.array([] if joint.is_line else [normal @ (self.stiffness() * normal)])

    def stiffness_in_world(self, R_WP: Array) -> Array:
        """By which contacts that stick oppose turns, in W, shape (3, 3) [N m/rad].

        Args:
            R_WP: Rotation of the platform, shape (3, 3).
        """
        return np.asarray(R_WP @ np.diag(self.stiffness()) @ R_WP.T)

    def turns_of_rest(self, compliance: Array, R_WP: Array) -> float:
        """How far the platform may rest beside where it would without friction [rad].

        The moment that contacts may hold is any K z with |z| <= a; turned by it the furthest is
        a times the largest singular value of C R K.

        Args:
            compliance: C, turns by moments in W, shape (3, 3) [rad/(N m)].
            R_WP: Rotation of the platform, shape (3, 3).
        """
        return float(self.slip * np.linalg.norm(compliance @ R_WP @ np.diag(self.stiffness()), 2))

    def bent(self, turned: Array) -> Array:
        """z after turns one way from unbent contacts, [rad].

        Args:
            turned: s, any shape, >= 0 [rad].
        """
        return np.asarray(-self.slip * np.expm1(-np.asarray(turned, float) / self.slip))

    def bent_along(self, turns: Rotation) -> Array:
        """z where a platform turned from one orientation to the next, from unbent contacts at the
        first one, shape (n, 3) in P [rad]; how fast it turned does not matter.

        Args:
            turns: R_WP at n instants, each less than half a turn from the one before.
        """
        ways = (turns[:-1].inv() * turns[1:]).as_rotvec()
        out = np.zeros((len(ways) + 1, 3))
        x = np.linalg.norm(ways, axis=1) / self.slip
        slides = np.where(x > 1e-9, -np.expm1(-x) / np.where(x > 1e-9, x, 1.0), 1.0)
        for k, (way, kept, slide) in enumerate(zip(ways, np.exp(-x), slides, strict=True)):
            out[k + 1] = kept * out[k] + slide * way
        return out

    def loop(self, turns: Array, amplitude: float, stiffness: float) -> tuple[Array, Array]:
        """Moments against turns between +-A, going up and coming back, shape (k,) each [N m].

        They are what must push, -M: above where the turn grows, below where it shrinks.

        Args:
            turns: Shape (k,), within +-A [rad].
            amplitude: A, above 0 [rad].
            stiffness: K about the axis [N m/rad].
        """
        a, top = self.slip, self.slip * np.tanh(amplitude / self.slip)
        up = a - (a + top) * np.exp(-(turns + amplitude) / a)
        back = (a + top) * np.exp(-(amplitude - turns) / a) - a
        return np.asarray(stiffness * up), np.asarray(stiffness * back)

    def loop_energy(self, amplitude: float, stiffness: float) -> float:
        """What a swing between +-A takes, there and back, after long [J]; as `loop`."""
        a = self.slip
        return float(4.0 * stiffness * a * (amplitude - a * np.tanh(amplitude / a)))


def contact_rates(bent: Any, turning: Any, slip: float) -> Any:
    """dz/dt, shape (k,) [rad/s]; arrays of floats or of AutoDiffXd.

    Args:
        bent: z, shape (k,) [rad].
        turning: w in the same axes, shape (k,) [rad/s].
        slip: a, above 0 [rad].
    """
    square = np.sum(turning * turning)
    if not square > 0.0:
        return turning
    return turning - np.sqrt(square) / slip * bent
