"""Thresholds below which a cable counts as slack, as functions of its length."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array

SHAPES = ("linear", "exponential")
"""How a threshold falls from the shortest cable to the longest."""


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
    raise ValueError(f"shape: found {shape!r}; accepted: {', '.join(SHAPES)}")
