"""What a source states, beside what a study found, and how the tables of studies look."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from rich.box import SIMPLE_HEAD
from rich.table import Table

CONFIRMED = "confirmed"
IN_PART = "in part"
NOT_CONFIRMED = "not confirmed"
NOT_TESTABLE = "not testable"
"""The study could not have found otherwise, or looks at nothing that the statement is about."""
NOT_JUDGED = "not judged"
"""Checking what was found ended in an error."""
NOT_IN_QUICK = "not judged in the quick form"
"""The runs that it needs are those of the full form."""


@dataclass(frozen=True)
class Statement:
    """One statement of a source.

    Attributes:
        words: What it says.
        printed: Its numbers.
        found: The study's.
        verdict: CONFIRMED, IN_PART, NOT_CONFIRMED, NOT_TESTABLE, NOT_JUDGED or NOT_IN_QUICK.
        why: What is known of the difference; may be empty.
        name: That of its check, by which tables of what was published find it.
    """

    words: str
    printed: str
    found: str
    verdict: str
    why: str = ""
    name: str = ""

    def as_dict(self) -> dict[str, str]:
        """For JSON."""
        return asdict(self)


def verdict(every: bool, some: bool = False) -> str:
    """CONFIRMED where `every` part of a statement holds, IN_PART where `some` does."""
    return CONFIRMED if every else IN_PART if some else NOT_CONFIRMED


def new_table(title: str, left: Sequence[str], right: Sequence[str]) -> Table:
    """An empty table with columns of words, then columns of numbers."""
    table = Table(
        title=title, title_justify="left", caption_justify="left", box=SIMPLE_HEAD, pad_edge=False
    )
    for heading in left:
        table.add_column(heading)
    for heading in right:
        table.add_column(heading, justify="right")
    return table
