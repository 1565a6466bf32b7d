"""The wrench that pushes a platform, from tensions and poses: three observers and what they err by.

* `static`: what balances cables and weight, w = -(F + w_g), smoothed with a time constant of
  1 / omega. It takes the platform's own acceleration for a wrench.
* `momentum`: w = p' - F - w_g, smoothed likewise, p the momentum; De Luca's momentum observer,
  whose residual is a filter of first order of the true wrench, in discrete time and about the
  centre of mass, where momentum has no terms of velocity.
* `extended`: pose, velocity and wrench are the states of an observer, with all poles of its error
  at omega. It needs no velocity, and lags by three time constants in place of one.

**Bias.** Each is exact for a constant wrench, where pose, tensions, mass and centre of mass are as
believed. What is wrong by a constant b of tensions is wrong by J' b for good; a mass that is wrong
by m is a wrench of its weight. **Delay** and the noise that is let through are numbers of
`observer_response`, of the recursion itself; `WrenchError` puts them together. What stands between
tension sensors and the platform, pulleys, is `tension_at_platform`; friction of drums is before the
sensors, and does not matter to them.

Sources: A. De Luca, A. Albu-Schaeffer, S. Haddadin, G. Hirzinger, Collision detection and safe
reaction with the DLR-III lightweight manipulator arm, IROS 2006; J. Han, From PID to active
disturbance rejection control, IEEE Transactions on Industrial Electronics 56(3), 2009; gains of
the latter by Z. Gao, Scaling and bandwidth-parameterization, ACC 2003, here for sampled poles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.wrench_observer_kernel import (
    BODY_SIZE,
    MEMORY_SIZE,
    SEEN,
    extended_step,
    momentum_step,
    static_step,
)

STATIC, MOMENTUM, EXTENDED = "static", "momentum", "extended"

OBSERVERS: dict[str, Callable[..., None]] = {
    STATIC: static_step,
    MOMENTUM: momentum_step,
    EXTENDED: extended_step,
}
"""The kernels, by name."""


def packed_body(mass: float, p_PCo: Array, I_PPo: Array, gravity: Array) -> Array:
    """A body for the kernels, shape (`BODY_SIZE`,).

    Args:
        mass: Mass [kg].
        p_PCo: Centre of mass in P, shape (3,) [m].
        I_PPo: Rotational inertia about Po in P, shape (3, 3) [kg m^2].
        gravity: Acceleration of a falling body in W, shape (3,) [m/s^2].
    """
    c = np.asarray(p_PCo, float)
    central = I_PPo - mass * (c @ c * np.eye(3) - np.outer(c, c))
    body = np.concatenate([[mass], c, np.ravel(central), np.asarray(gravity, float)])
    assert body.shape == (BODY_SIZE,)
    return body


class WrenchObserver:
    """One of `OBSERVERS` on a body, with its memory.

    Attributes:
        kind: Its name.
        memory: Shape (`MEMORY_SIZE`,); zeros forget all.
    """

    def __init__(self, kind: str, body: Array, bandwidth: float, period: float) -> None:
        """With a packed body, omega [1/s], and the time between samples [s]."""
        self.kind, self.memory = kind, np.zeros(MEMORY_SIZE)
        self._step, self._body = OBSERVERS[kind], body
        self._rates, self._out = np.array([bandwidth, period]), np.zeros(6)

    def update(self, X_WP: RigidTransform, cables: Array) -> Array:
        """The estimate after a sample, moment about Po and force in W, shape (6,) [N m, N].

        Args:
            X_WP: Pose of the platform [m].
            cables: Wrench of the cables about Po in W, shape (6,) [N m, N].
        """
        R = np.ascontiguousarray(X_WP.rotation().matrix()).ravel()
        p = np.ascontiguousarray(X_WP.translation())
        self._step(R, p, cables, self._body, self._rates, self.memory, self._out)
        return self._out.copy()

    @property
    def samples(self) -> int:
        """How many there were."""
        return int(self.memory[SEEN])


@dataclass(frozen=True)
class ObserverResponse:
    """What an observer does to what it reads, of a mass of one on a line.

    Attributes:
        delay: By how much it shows a slow wrench late [s].
        tension_noise: Variance of the estimate per variance of white noise of the known force.
        pose_noise: The same per variance of white noise of the position [1/s^4].
    """

    delay: float
    tension_noise: float
    pose_noise: float


@lru_cache
def observer_response(kind: str, bandwidth: float, period: float) -> ObserverResponse:
    """How an observer answers impulses of noise, by its own recursion.

    Args:
        kind: A name of `OBSERVERS`.
        bandwidth: omega [1/s].
        period: Time between samples [s].
    """
    body = packed_body(1.0, np.zeros(3), np.eye(3), np.zeros(3))
    count = int(np.ceil(30.0 / (bandwidth * period))) + 10
    answers = []
    for force in (1.0, 0.0):
        observer, row = WrenchObserver(kind, body, bandwidth, period), []
        for k in range(count + 3):
            hit = 1.0 if k == 3 else 0.0
            X = RigidTransform(np.array([(1.0 - force) * hit, 0.0, 0.0]))
            row.append(observer.update(X, np.array([0.0, 0.0, 0.0, force * hit, 0.0, 0.0]))[3])
        answers.append(np.array(row[3:]))
    seen, moved = -answers[0], answers[1]
    late = float(np.arange(len(seen)) @ seen / np.sum(seen)) * period
    return ObserverResponse(late, float(seen @ seen), float(moved @ moved))


@dataclass(frozen=True, kw_only=True)
class WrenchError:
    """What a wrench estimate errs by, from what its readings err by; all independent by cable.

    Attributes:
        noise: Standard deviation of a tension's reading [N].
        offset: Of a tension sensor's constant error [N].
        friction: Largest share of a tension that pulleys between sensor and platform take at rest,
            either way; uniform.
        length: Standard deviation of a length's reading [m].
    """

    noise: float = 0.0
    offset: float = 0.0
    friction: float = 0.0
    length: float = 0.0

    def covariance(
        self,
        J: Array,
        tensions: Array,
        mass: Array,
        response: ObserverResponse,
        compliance: Array | float = 0.0,
    ) -> Array:
        """Covariance of an estimate, shape (6, 6), (moment about Po, force) in W.

        Args:
            J: Length rates per twist, shape (m, 6), of rank 6.
            tensions: Shape (m,) [N].
            mass: Spatial inertia about Po in W, shape (6, 6).
            response: Of the observer.
            compliance: By how much a cable is longer per tension, shape (m,), where its length is
                that of the drum stretched by the reading [m/N].
        """
        constant = self.noise**2 * response.tension_noise + self.offset**2
        each = constant + (self.friction * np.asarray(tensions)) ** 2 / 3.0
        found = (J.T * each) @ J
        if response.pose_noise > 0.0:
            lengths = self.length**2 + (self.noise * np.broadcast_to(compliance, len(J))) ** 2
            solve = np.linalg.pinv(J)
            pose = (solve * lengths) @ solve.T
            found = found + response.pose_noise * mass @ pose @ mass
        return np.asarray(found)


def tension_at_platform(
    measured: Array, length_rates: Array, share: float, fading_speed: float
) -> Array:
    """Tension at the platform of a cable that is measured before its pulley.

    The pulley takes a share of the tension, against the motion: a cable that is wound in pulls less
    at the platform, one that is paid out more. Below a small speed that fades, since at rest
    friction may point either way.

    Args:
        measured: Shape (m,) [N].
        length_rates: Of the cables, positive paid out, shape (m,) [m/s].
        share: Share of the tension that the pulley takes, from 0 to below 1.
        fading_speed: Above 0 [m/s].

    Returns:
        Shape (m,) [N].
    """
    way = np.clip(np.asarray(length_rates) / fading_speed, -1.0, 1.0)
    return np.asarray(measured) * (1.0 + share * way)


def tension_before_pulley(
    tensions: Array, length_rates: Array, share: float, fading_speed: float
) -> Array:
    """The reading that `tension_at_platform` undoes, of tensions there, shape (m,) [N]."""
    way = np.clip(np.asarray(length_rates) / fading_speed, -1.0, 1.0)
    return np.asarray(tensions) / (1.0 + share * way)
