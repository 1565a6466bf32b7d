"""Velocities that bring tensions back into the feasible polygon, and leave the platform alone."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array

SLACK_SHARE = 0.25
"""A cable that has less than this of its least tension is taken for slack: it does not answer. Half
of the bound where the margin is as large as that."""


def polygon_target(
    tensions: Array, middle: Array, W: Array, *, lower: Array, upper: Array, margin: float
) -> tuple[Array, Array]:
    """What of measured tensions is out of the feasible polygon, and how they come back.

    Tensions that balance the same wrench as the middle differ from it within the null space of W:
    with two cables to spare, in a plane, where the bounds cut out the feasible polygon. Measured
    tensions are projected there; of those that are not inside by a margin, the way to the middle is
    gone until they are.

    Args:
        tensions: Measured tensions, shape (m,) [N].
        middle: Feasible tensions to go to, as a distribution gives them, shape (m,) [N].
        W: Wrench matrix at the believed pose, shape (n, m).
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        margin: Distance to keep from both, not negative; less where the middle itself has less [N].

    Returns:
        Tensions that are missing, shape (m,) [N], in the null space of W, zero where all is well;
        and the least tension of each cable, shape (m,) [N].

    Source: servoing thesis 5.2.1 and (1.29) for the polygon; its perspective of thresholds from it.
    """
    least, most = np.minimum(lower + margin, middle), np.maximum(upper - margin, middle)
    away = null_part(W, np.asarray(tensions) - middle)
    room = np.where(away < 0.0, middle - least, most - middle)
    far = np.abs(away) > room
    share = float(np.min(room[far] / np.abs(away[far]), initial=1.0))
    return (share - 1.0) * away + 0.0, least


def polygon_correction(
    tensions: Array,
    missing: Array,
    least: Array,
    W: Array,
    lengths: Array,
    gains: Array,
) -> Array:
    """Cable velocities that add missing tensions and do not move the platform, to first order.

    A cable gives in proportion to its length, so shortening each by length times a tension of the
    null space changes tensions by that, and the platform stays. Slack cables do not answer: they
    are wound up, which moves nothing, and what the taut ones can do without them is done.

    Args:
        tensions: Measured tensions, shape (m,) [N].
        missing: From `polygon_target`, shape (m,) [N].
        least: Its least tensions, shape (m,) [N].
        W: Wrench matrix at the believed pose, shape (n, m).
        lengths: Unstrained lengths, shape (m,) [m].
        gains: Velocity per missing tension of a cable of mean length, shape (m,) [m/(N s)].

    Returns:
        To be added to the commanded velocities, shape (m,) [m/s].
    """
    slack = np.asarray(tensions) < SLACK_SHARE * least
    found = np.zeros(len(slack))
    found[slack] = -(gains * np.maximum(least - tensions, 0.0))[slack]
    taut = ~slack
    if np.sum(taut) > W.shape[0]:
        wanted = null_part(W[:, taut], missing[taut])
        found[taut] = -(gains * lengths / np.mean(lengths))[taut] * wanted
    return found + 0.0


def null_part(W: Array, tensions: Array) -> Array:
    """The part of tensions, shape (m,) [N], that makes no wrench by W, shape (n, m)."""
    rows = np.linalg.svd(W)[2][W.shape[0] :]
    return np.asarray(rows.T @ (rows @ tensions))
