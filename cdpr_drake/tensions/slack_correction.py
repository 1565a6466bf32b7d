"""Laws that correct tensions by cable velocities: wind up slack, follow wanted tensions.

`tension_correction` and `length_correction` wind up a cable whose tension is too small, or which is
too long. `polygon_target` and `polygon_correction` bring tensions back into the feasible polygon
and leave the platform alone. `TensionFollower` follows wanted tensions from both sides.
`length_thresholds` gives thresholds of slack as functions of cable lengths. Velocities are added to
the commanded ones [m/s]; negative ones shorten a cable.

Source: servoing thesis 5.2.1, (5.1), (5.3), (5.4), (5.5), Fig. 5.3; (1.29) for the polygon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import accepted_names

SLACK_SHARE = 0.25
"""A cable that has less than this of its least tension is taken for slack: it does not answer. Half
of the bound where the margin is as large as that."""

SHAPES = ("linear", "exponential")
"""How a threshold falls from the shortest cable to the longest."""


def tension_correction(tensions: Array, thresholds: Array, gains: Array) -> Array:
    """Cable velocities that wind up cables whose tension is below a threshold.

    Args:
        tensions: Measured tensions, shape (m,) [N].
        thresholds: Tension below which a cable counts as slack, shape (m,) [N].
        gains: Velocity per missing tension, not negative, shape (m,) [m/(N s)].

    Returns:
        To be added to the commanded velocities, shape (m,) [m/s]; never positive.

    Source: servoing thesis (5.1); with `adaptive_gains` (5.4).
    """
    missing = np.maximum(np.subtract(thresholds, tensions), 0.0)
    return -np.asarray(gains) * missing


def adaptive_gains(lengths: Array, expected: Array, gain_per_length: float) -> Array:
    """Gains for `tension_correction` that grow with what each cable is too long by.

    Args:
        lengths: Measured unstrained lengths, shape (m,) [m].
        expected: Lengths at the believed pose, shape (m,) [m].
        gain_per_length: Gain per surplus length, not negative [1/(N s)].

    Returns:
        Gains, shape (m,) [m/(N s)]; zero for a cable that is shorter than expected, which (5.3)
        would pay out.

    Source: servoing thesis (5.3).
    """
    return gain_per_length * np.maximum(np.subtract(lengths, expected), 0.0)


def length_thresholds(
    lengths: Array,
    shortest: float,
    longest: float,
    *,
    lowest: Array,
    highest: Array,
    shape: str = "linear",
) -> Array:
    """Thresholds that are higher for shorter cables, which carry more of the platform.

    Args:
        lengths: Lengths of the cables, shape (m,) [m].
        shortest: Length at which a threshold is `highest`, and below [m].
        longest: Length at which it is `lowest`, and above; larger than `shortest` [m].
        lowest: Shape (m,) [N].
        highest: Not below `lowest`, shape (m,) [N]; both positive if exponential.
        shape: One of `SHAPES`: in between, the threshold or its logarithm is linear in the length.

    Returns:
        Shape (m,) [N].

    Source: servoing thesis 5.2.1, "Threshold as a function of cable lengths", which leaves the
    function open.
    """
    share = np.clip((longest - np.asarray(lengths)) / (longest - shortest), 0.0, 1.0)
    if shape == "linear":
        return lowest + share * np.subtract(highest, lowest)
    if shape == "exponential":
        return np.asarray(lowest * np.exp(share * np.log(np.divide(highest, lowest))))
    raise ValueError(f"shape: found {shape!r}; {accepted_names(shape, SHAPES)}")


def length_correction(
    tensions: Array,
    lengths: Array,
    expected: Array,
    *,
    allowance: float,
    slowness: float,
    period: float,
    count: int = 2,
) -> Array:
    """Cable velocities that wind up the cables of least tension to the length that is expected.

    Args:
        tensions: Measured tensions, shape (m,) [N].
        lengths: Measured unstrained lengths, shape (m,) [m].
        expected: Lengths at the believed pose, shape (m,) [m].
        allowance: Surplus that is left alone, l_t, not negative [m].
        slowness: Number of periods that the correction takes, k_l, at least 1.
        period: Time between corrections [s].
        count: How many cables are corrected; of equal tensions the first ones.

    Returns:
        To be added to the commanded velocities, shape (m,) [m/s]; never positive.

    Source: servoing thesis (5.5).
    """
    found = np.zeros(len(tensions))
    for cable in np.argsort(tensions, kind="stable")[:count]:
        surplus = lengths[cable] - expected[cable] - allowance
        if surplus > 0.0:
            found[cable] = -surplus / (slowness * period)
    return found


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


@dataclass(frozen=True)
class TensionFollower:
    """A PID controller for each cable, from the tension that is missing to a cable velocity.

    Attributes:
        proportional: Velocity per missing tension [m/(N s)].
        integral: Velocity per missing tension and second [m/(N s2)].
        derivative: Velocity per rate of the missing tension [m/N].
        fastest: Largest velocity of a correction [m/s]. While a cable is at it, its integral does
            not grow further.

    Source: servoing thesis 5.2.1, "Obtaining the threshold through TDA", and Fig. 5.3.
    """

    proportional: float
    integral: float = 0.0
    derivative: float = 0.0
    fastest: float = np.inf

    def step(
        self, missing: Array, before: Array | None, integrated: Array, period: float
    ) -> tuple[Array, Array]:
        """Cable velocities and the new integral.

        Args:
            missing: Wanted tensions less measured ones, shape (m,) [N].
            before: The same a period before; None at the first step.
            integrated: Integral of the missing tensions so far, shape (m,) [N s].
            period: Time between steps [s].

        Returns:
            Velocities to be added to the commanded ones, shape (m,) [m/s], negative where tension
            is missing, and the integral with this step, shape (m,) [N s].
        """
        grown = integrated + period * missing
        rate = np.zeros_like(missing) if before is None else (missing - before) / period
        wanted = -(self.proportional * missing + self.integral * grown + self.derivative * rate)
        held = np.clip(wanted, -self.fastest, self.fastest)
        # An integral that would push further against the limit is left as it was.
        winding = (held != wanted) & (np.sign(missing) == -np.sign(wanted))
        return held, np.where(winding, integrated, grown)
