"""Looks answers up, and puts them in words."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from cdpr_drake.analyses.studies.stability_ranges.item import RangeRow


class FoundRows:
    """Rows of a study by section and group."""

    def __init__(self, rows: Sequence[RangeRow]) -> None:
        """Takes the rows that were finished."""
        self._rows = tuple(rows)

    def of(self, section: str, group: str, least: int = 2) -> list[RangeRow]:
        """Rows of a group, in their order.

        Raises:
            KeyError: There are fewer than `least`.
        """
        some = [row for row in self._rows if row.section == section and row.group == group]
        if len(some) < least:
            raise KeyError(group)
        return some

    def named(self, name: str) -> RangeRow:
        """One row.

        Raises:
            KeyError: It is not there.
        """
        for row in self._rows:
            if row.name == name:
                return row
        raise KeyError(name)


NESTED = (
    "Limits are sets with everything within, so a smaller one cannot allow less: not that the "
    "limit falls was found, but that it is not constant."
)
"""Why such an order is no discovery."""


def found(rows: Sequence[RangeRow]) -> list[float]:
    """What was found in each row."""
    return [row.found for row in rows]


def falls(values: Sequence[float]) -> bool:
    """Whether values never rise and end below where they begin."""
    never = all(b <= a + 1e-9 for a, b in pairwise(values))
    return never and values[-1] < values[0]


def listed(rows: Sequence[RangeRow]) -> str:
    """What was found in each row, in words."""
    return ", ".join(f"{row.found:.3g}" for row in rows)


def pairs(rows: Sequence[RangeRow], name: str, unit: str) -> str:
    """Words such as `0.15 m at 0, 0.1 m at 0.3 m`: found at each value of a limit."""
    return (
        ", ".join(f"{row.found:.3g} at {row.limits.get(name, 0.0):g} {unit}" for row in rows)
        + f" [{rows[0].unit}]"
    )
