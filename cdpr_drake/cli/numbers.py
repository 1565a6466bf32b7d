"""Lists of numbers on the command line."""

from __future__ import annotations

import math

from cdpr_drake.errors import CdprError


def parse_numbers(option: str, words: str, sizes: tuple[int, ...], meaning: str) -> list[float]:
    """Finite numbers separated by commas.

    Args:
        option: Name of the option, for the message.
        words: What the user wrote.
        sizes: How many numbers are accepted.
        meaning: Words that explain them, for the message.

    Raises:
        CdprError: They are not numbers, not finite, or too many or too few.
    """
    try:
        values = [float(word) for word in words.split(",")]
    except ValueError:
        values = []
    if len(values) not in sizes or not all(math.isfinite(value) for value in values):
        raise CdprError(f"{option}: found {words!r}; accepted: {meaning}")
    return values
