"""What cables do beside the elastic law, from measured tensions, strains and temperatures.

Each is least squares of one law of `cables.cable_behaviour`, weighted by the noise that is told;
standard errors are those of the noise, times what residuals are more than that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from cdpr_drake.arrays import Array
from cdpr_drake.cables.cable_behaviour import CableBehaviour, creep_step, strain_of_tension
from cdpr_drake.errors import IdentificationError

ALIKE = 1e-9
"""Least eigenvalue of the unknowns' correlation below which they are not told apart."""


@dataclass(frozen=True, eq=False)
class BehaviourFit:
    """What was found.

    Attributes:
        names: Of the unknowns.
        values: Shape (f,).
        std: Standard errors, shape (f,).
        spread: Residuals over sigma, root mean square with the degrees that are left.
        degrees: Equations less unknowns.
    """

    names: tuple[str, ...]
    values: Array
    std: Array
    spread: float
    degrees: int


def fit_stiffening(tensions: Array, strains: Array, sigma: float) -> BehaviourFit:
    """E S [N] and stiffening g [1/N] of a cable.

    Args:
        tensions: Shape (k,), not negative [N].
        strains: Shape (k,) [-].
        sigma: Standard deviation of strains [-].

    Raises:
        IdentificationError: The samples do not tell both.
    """
    t, e = np.asarray(tensions, float), np.asarray(strains, float)
    start = np.array([float(t @ t / (t @ e)), 0.1 / max(float(np.max(t)), 1e-300)])

    def residuals(x: Array) -> Array:
        return (e - strain_of_tension(t, np.array(x[0] * start[0]), x[1] * start[1])) / sigma

    return _fitted(("stiffness", "stiffening"), residuals, np.ones(2), start)


def fit_expansion(
    temperatures: Array, tensions: Array, strains: Array, sigma: float
) -> BehaviourFit:
    """E S [N], expansion a [1/K] and the zero of strains [-] of a cable.

    Args:
        temperatures: Above that at which lengths are counted, shape (k,) [K].
        tensions: Shape (k,) [N].
        strains: Of lengths over those that are counted, shape (k,) [-].
        sigma: Standard deviation of strains [-].

    Raises:
        IdentificationError: The samples do not tell all three.
    """
    dT, t, e = (np.asarray(x, float) for x in (temperatures, tensions, strains))
    start = np.array([float(t @ t / max(t @ e, 1e-300)), 1e-5, 1e-4])

    def residuals(x: Array) -> Array:
        longer = 1.0 + start[1] * x[1] * dT
        loaded = 1.0 + t / (start[0] * x[0])
        return (e - (longer * loaded - 1.0) - start[2] * x[2]) / sigma

    names = ("stiffness", "expansion", "zero")
    return _fitted(names, residuals, np.array([1.0, 0.0, 0.0]), start)


def fit_sheave_friction(
    tensions: Array, drums: Array, wraps: Array, direction: Array, sigma: float
) -> BehaviourFit:
    """Friction mu of a cable over its pulley.

    Args:
        tensions: Between pulley and platform, shape (k,), above 0 [N].
        drums: At the drum, shape (k,), above 0 [N].
        wraps: Shape (k,) [rad].
        direction: 1 wound up, -1 paid out, 0 at rest, which tells nothing, shape (k,).
        sigma: Standard deviation of both tensions [N].

    Raises:
        IdentificationError: Tensions are not above 0, or no cable moves over a pulley.
    """
    t, d = np.asarray(tensions, float), np.asarray(drums, float)
    if np.any(t <= 0.0) or np.any(d <= 0.0):
        raise IdentificationError("sheave friction: found a tension of 0; accepted: above 0 [N]")
    weight = 1.0 / (sigma * np.hypot(1.0 / t, 1.0 / d))
    angle = np.asarray(wraps, float) * np.asarray(direction, float)

    def residuals(x: Array) -> Array:
        rows = (np.log(d / t) - 0.01 * x[0] * angle) * weight
        return np.asarray(rows[angle != 0.0])

    return _fitted(("sheave_friction",), residuals, np.ones(1), np.array([0.01]))


def fit_creep(time: Array, strains: Array, tensions: Array, sigma: float) -> BehaviourFit:
    """E S [N], creep stiffness E1 over E, and creep time tau [s] of a cable that had crept out.

    Args:
        time: Even or not, growing, shape (k,) [s].
        strains: Known well beside the tensions, shape (k,) [-].
        tensions: Shape (k,) [N].
        sigma: Standard deviation of tensions [N].

    Raises:
        IdentificationError: The samples do not tell all three.
    """
    t, e, pull = (np.asarray(x, float) for x in (time, strains, tensions))
    steps, rates = np.diff(t), np.diff(e) / np.diff(t)
    start = np.array([float(e @ pull / (e @ e)), 0.1, 0.1 * float(t[-1] - t[0])])

    def residuals(x: Array) -> Array:
        E = start[0] * x[0]
        law = CableBehaviour(
            creep_stiffness=start[1] * x[1], creep_time=start[2] * float(np.exp(x[2]))
        )
        s = np.zeros((len(t), 1))
        for k in range(len(steps)):
            s[k + 1] = creep_step(s[k], rates[k : k + 1], steps[k], np.array([E]), law)
        return (pull - E * e - s[:, 0]) / sigma

    found = _fitted(
        ("stiffness", "creep_stiffness", "creep_time"), residuals, np.array([1.0, 1.0, 0.0]),
        np.array([start[0], start[1], 1.0]),
    )  # fmt: skip
    tau = float(start[2] * np.exp(found.values[2]))
    values = np.array([*found.values[:2], tau])
    return BehaviourFit(
        found.names, values, np.array([*found.std[:2], found.std[2] * tau]), found.spread,
        found.degrees,
    )  # fmt: skip


def _fitted(
    names: tuple[str, ...], residuals: Callable[[Array], Array], start: Array, sizes: Array
) -> BehaviourFit:
    """Least squares in sizes of the unknowns.

    Raises:
        IdentificationError: Fewer samples than unknowns, or they do not tell them apart.
    """
    count = len(residuals(start))
    if count <= len(names):
        raise IdentificationError(
            f"{', '.join(names)}: found {count} samples that tell of them; accepted: more than "
            f"{len(names)}"
        )
    found = least_squares(residuals, start, method="lm", xtol=1e-12, ftol=1e-12)
    N = found.jac.T @ found.jac
    scale = np.sqrt(np.diag(N))
    alike = N / np.outer(scale, scale) if np.all(scale > 0.0) else np.ones_like(N)
    if np.any(scale == 0.0) or (len(N) > 1 and np.linalg.eigvalsh(alike)[0] < ALIKE):
        raise IdentificationError(
            f"{', '.join(names)}: found samples that do not tell them apart; accepted: tensions, "
            "temperatures or times that differ more"
        )
    degrees = count - len(names)
    spread = float(np.sqrt(2.0 * found.cost / degrees))
    std = np.sqrt(np.diag(np.linalg.inv(N))) * max(spread, 1.0)
    return BehaviourFit(names, sizes * found.x, np.abs(sizes) * std, spread, degrees)
