"""What logs of real cables show beside a constant modulus: stiffening, heat, sheaves, creep.

Stiffening: tangent stiffness grows with tension, dt/de = E S (1 + g t), so that

    t = E S (exp(g E S e) - 1) / (g E S),        e = log(1 + g t) / (g E S).

Heat: an unstrained length becomes l0 (1 + a dT). Sheaves: over a groove with friction mu and wrap
theta the drum pulls t exp(mu theta) where cable is wound up, t exp(-mu theta) where it is paid out.
Creep: the standard linear solid, a spring E S beside a spring E1 S in series with a dashpot,

    t = E S e + s,        ds/dt = E1 S de/dt - s / tau,

whose loop under a wave of strain takes pi E1 S e^2 w tau / (1 + w^2 tau^2) of energy a metre.

Off is g = 0, a dT = 0, mu = 0, E1 = 0: functions then give what they are given, to the bit.

Source: Feyrer, Wire Ropes, 2015, 1.4 (modulus) and 3.1 (sheaves); Flugge, Viscoelasticity, 1975,
chapter 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CableModelError
from cdpr_drake.geometry.cable_set import CableSet


@dataclass(frozen=True, kw_only=True)
class CableBehaviour:
    """What cables do beside the elastic law; as it is made, nothing.

    Attributes:
        stiffening: g, growth of the tangent stiffness per tension [1/N].
        expansion: a, of unstrained lengths with temperature [1/K].
        warmer: dT, above the temperature at which lengths are counted [K].
        sheave_friction: mu, of cables in the grooves of their pulleys [-].
        creep_stiffness: E1 over E, of the spring that creeps away [-].
        creep_time: tau, in which it does [s].
        sliding_speed: v, at which friction in a groove is tanh(1) of all it can be [m/s].
    """

    stiffening: float = 0.0
    expansion: float = 0.0
    warmer: float = 0.0
    sheave_friction: float = 0.0
    creep_stiffness: float = 0.0
    creep_time: float = 1.0
    sliding_speed: float = 1e-3

    def changes_lengths(self) -> bool:
        """Whether lengths under tension differ from those of the elastic law."""
        return self.stiffening != 0.0 or self.expansion * self.warmer != 0.0

    def is_there(self) -> bool:
        """Whether the cables do anything beside the elastic law."""
        return self.changes_lengths() or self.sheave_friction != 0.0 or self.creep_stiffness != 0.0

    def longer(self) -> float:
        """By which factor heat makes unstrained lengths longer."""
        return 1.0 + self.expansion * self.warmer


def behaving_cables(cables: CableSet, behaviour: CableBehaviour) -> CableSet:
    """The cables with what they do beside the elastic law, as engines take them.

    Args:
        cables: The cables.
        behaviour: What they do; where it is nothing, the same cables come back.

    Raises:
        CableModelError: A time or speed is not above 0, or a number is below 0.
    """
    if not behaviour.is_there():
        return cables
    for name in ("stiffening", "sheave_friction", "creep_stiffness"):
        value = getattr(behaviour, name)
        if not value >= 0.0:
            raise CableModelError(f"{name}: found {value:g}; accepted: >= 0")
    for name, unit in (("creep_time", "s"), ("sliding_speed", "m/s")):
        value = getattr(behaviour, name)
        if not value > 0.0:
            raise CableModelError(f"{name}: found {value:g}; accepted: > 0 [{unit}]")
    beyond = [
        behaviour.stiffening, behaviour.longer(), behaviour.sheave_friction,
        behaviour.sliding_speed, behaviour.creep_stiffness, behaviour.creep_time,
    ]  # fmt: skip
    return replace(cables, beyond=np.array(beyond))


def behaviour_of(cables: CableSet) -> CableBehaviour:
    """What cables do beside the elastic law, as `behaving_cables` left it with them."""
    if not cables.beyond.size:
        return CableBehaviour()
    g, longer, friction, speed, creep, time = cables.beyond.tolist()
    return CableBehaviour(
        stiffening=g, expansion=longer - 1.0, warmer=1.0, sheave_friction=friction,
        sliding_speed=speed, creep_stiffness=creep, creep_time=time,
    )  # fmt: skip


def strain_of_tension(tensions: Array, stiffness: Array, stiffening: float = 0.0) -> Array:
    """Strain e of taut cables, shape (m,) [-].

    Args:
        tensions: Shape (m,), not negative [N].
        stiffness: E S without tension, shape (m,) [N].
        stiffening: g [1/N].
    """
    if stiffening == 0.0:
        return np.asarray(tensions / stiffness, float)
    return np.asarray(np.log1p(stiffening * tensions) / (stiffening * stiffness), float)


def tension_of_strain(strains: Array, stiffness: Array, stiffening: float = 0.0) -> Array:
    """Tensions of cables that only pull, shape (m,) [N]; arguments as `strain_of_tension`."""
    taut = np.maximum(strains, 0.0)
    if stiffening == 0.0:
        return np.asarray(stiffness * taut, float)
    return np.asarray(np.expm1(stiffening * stiffness * taut) / stiffening, float)


def tangent_stiffness(tensions: Array, stiffness: Array, stiffening: float = 0.0) -> Array:
    """dt/de at tensions, shape (m,) [N]; arguments as `strain_of_tension`."""
    return np.asarray(stiffness * (1.0 + stiffening * tensions), float)


def strain_energy(strains: Array, stiffness: Array, stiffening: float = 0.0) -> Array:
    """Energy per unstrained length, shape (m,) [J/m]; arguments as `strain_of_tension`."""
    taut = np.maximum(strains, 0.0)
    if stiffening == 0.0:
        return np.asarray(0.5 * stiffness * taut**2, float)
    k = stiffening * stiffness
    return np.asarray((np.expm1(k * taut) / k - taut) / stiffening, float)


def counted_lengths(
    lengths: Array, tensions: Array, stiffness: Array, behaviour: CableBehaviour
) -> Array:
    """Unstrained lengths that a winch counts, where cables under tension have others, (m,) [m].

    Args:
        lengths: Under tension, shape (m,) [m].
        tensions: Shape (m,), not negative [N].
        stiffness: E S without tension, shape (m,) [N].
        behaviour: What the cables do.
    """
    strains = strain_of_tension(tensions, stiffness, behaviour.stiffening)
    return np.asarray(lengths / (1.0 + strains) / behaviour.longer(), float)


def tangent_cables(
    cables: CableSet, counted: Array, tensions: Array, behaviour: CableBehaviour
) -> tuple[CableSet, Array]:
    """Linear cables that touch the law at tensions: they have its tension and its slope there.

    With them what the elastic law knows holds to first order: stiffness, modes, sensitivity.

    Args:
        cables: The cables, E S without tension.
        counted: Unstrained lengths that winches count, shape (m,) [m].
        tensions: Shape (m,), not negative [N].
        behaviour: What the cables do.

    Returns:
        The cables with another stiffness, and their unstrained lengths, shape (m,) [m].
    """
    if not behaviour.changes_lengths():
        return cables, counted
    l0 = counted * behaviour.longer()
    g = behaviour.stiffening
    lengths = l0 * (1.0 + strain_of_tension(tensions, cables.stiffness, g))
    slope = tangent_stiffness(tensions, cables.stiffness, g) / l0
    touching = lengths - tensions / slope
    return replace(cables, stiffness=slope * touching), np.asarray(touching, float)


def drum_tensions(tensions: Array, wraps: Array, friction: float, direction: Array) -> Array:
    """Tensions at the drums of cables over grooves with friction, shape (m,) [N].

    Args:
        tensions: Between pulley and platform, shape (m,) [N].
        wraps: Angles over which cables lie in grooves, shape (m,) [rad].
        friction: mu [-].
        direction: 1 where cable is wound up (the platform is lifted), -1 where it is paid out, 0
            where nothing slides and friction may be anything between, shape (m,).

    Source: Euler and Eytelwein.
    """
    if friction == 0.0:
        return np.asarray(tensions, float)
    return np.asarray(tensions * np.exp(friction * wraps * direction), float)


def creep_step(
    s: Array, strain_rate: Array, step: float, stiffness: Array, behaviour: CableBehaviour
) -> Array:
    """What creeps away of the tension, after a step at a constant rate of strain, shape (m,) [N].

    Exact: s tends to E1 S tau de/dt as exp(-h / tau).

    Args:
        s: Before, shape (m,) [N].
        strain_rate: Shape (m,) [1/s].
        step: h [s].
        stiffness: E S, shape (m,) [N].
        behaviour: What the cables do.

    Raises:
        CableModelError: The time of creep is not above 0.
    """
    tau = behaviour.creep_time
    if not tau > 0.0:
        raise CableModelError(f"creep_time: found {tau:g}; accepted: > 0 [s]")
    end = behaviour.creep_stiffness * stiffness * tau * strain_rate
    return np.asarray(end + (s - end) * np.exp(-step / tau), float)


def creep_strain(tension: float, time: Array, stiffness: float, behaviour: CableBehaviour) -> Array:
    """Strain under a tension that is put on at time 0 and stays, shape (k,) [-].

    e = t / E S (1 - q exp(-(1 - q) t / tau)), q = E1 / (E + E1).

    Args:
        tension: [N].
        time: Shape (k,), >= 0 [s].
        stiffness: E S [N].
        behaviour: What the cable does.
    """
    q = behaviour.creep_stiffness / (1.0 + behaviour.creep_stiffness)
    decay = np.exp(-(1.0 - q) * np.asarray(time, float) / behaviour.creep_time)
    return np.asarray(tension / stiffness * (1.0 - q * decay), float)


def loop_energy(
    amplitude: float, pulsation: float, stiffness: float, behaviour: CableBehaviour
) -> float:
    """Energy that a cable takes in a wave of strain, per unstrained length [J/m].

    Args:
        amplitude: Of the strain [-].
        pulsation: w [rad/s].
        stiffness: E S [N].
        behaviour: What the cable does.
    """
    x = pulsation * behaviour.creep_time
    E1 = behaviour.creep_stiffness * stiffness
    return float(np.pi * E1 * amplitude**2 * x / (1.0 + x * x))
