"""Dry and viscous friction of a motor that holds exactly what it can hold.

Sliding, the friction torque at speed w is the Stribeck curve

    g(|w|) sign(w) + F_v w,   g(w) = F_c + (F_s - F_c) exp(-w / w_s).

At rest dry friction is a reaction: it takes whatever value keeps the motor at rest, up to F_s. Laws
that smooth the jump at w = 0 creep under every load; here the reaction itself is written down,

    f = clip(n + J w / T, -g, g),   J dw/dt = n - f,

n being all other torques on the inertia J and T a settling time. Where the clip does not act,
dw/dt = -w / T: the motor settles exponentially, and from w = 0 it does not move at all, exactly,
however n changes below F_s. Where it acts, f is the sliding law. The right hand side is continuous
with slope 1 / T, so an explicit integrator follows it with steps up to 2 T and cannot chatter, and
there is no extra state. The price: a motor that comes to rest slides on by T^2 (g - |n|) / (2 J) or
less beyond where the discontinuous law stops it, and in a reversal under load friction turns up to
T early.

Arrays may hold AutoDiffXd.

Source: servoing thesis (5.7), which is printed for positive speeds; Karnopp (1985) for friction as
a reaction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array


@dataclass(frozen=True)
class FrictionLaw:
    """Friction of a motor with its gears and drum, at the motor's shaft; all zero: none.

    Attributes:
        coulomb: F_c [N m].
        static: F_s, at least F_c [N m].
        viscous: F_v [N m s/rad].
        stribeck_speed: w_s [rad/s].
        settling_time: T [s].
    """

    coulomb: float = 0.0
    static: float = 0.0
    viscous: float = 0.0
    stribeck_speed: float = 1.0
    settling_time: float = 1e-3

    def sliding(self, speed: Array) -> Array:
        """Friction torque of a turning motor, against the speed, any shape [rad/s], in [N m]."""
        return np.asarray(self.dry(speed) * np.sign(speed) + self.viscous * speed)

    def dry(self, speed: Array) -> Array:
        """g, the largest dry friction at a speed [rad/s], any shape [N m]."""
        fade = np.exp(-np.abs(speed) / self.stribeck_speed)
        return np.asarray(self.coulomb + (self.static - self.coulomb) * fade)


def held_friction(largest: Array, net: Array, speed: Array, inertia: float, time: float) -> Array:
    """Dry friction f as a reaction, any shape [N m].

    Args:
        largest: g, the most that friction and brakes can take up [N m].
        net: n, all other torques on the inertia [N m].
        speed: w [rad/s].
        inertia: J [kg m^2].
        time: T, the settling time [s].
    """
    held = np.maximum(np.minimum(net + (inertia / time) * speed, largest), -largest)
    # Without friction there is no reaction to differentiate either.
    return np.asarray(np.where(largest > 0.0, held, 0.0 * net))
