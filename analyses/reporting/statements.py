"""What a source states, beside what a study found."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from typing import TypeVar

CONFIRMED = "confirmed"
IN_PART = "in part"
NOT_CONFIRMED = "not confirmed"
NOT_TESTABLE = "not testable"
"""The study could not have found otherwise, or looks at nothing that the statement is about."""

Found = TypeVar("Found")
Said = TypeVar("Said")


@dataclass(frozen=True)
class Statement:
    """One statement of a source.

    Attributes:
        words: What it says.
        printed: Its numbers.
        found: The study's.
        verdict: CONFIRMED, IN_PART, NOT_CONFIRMED or NOT_TESTABLE.
        why: What is known of the difference; may be empty.
    """

    words: str
    printed: str
    found: str
    verdict: str
    why: str = ""

    def as_dict(self) -> dict[str, str]:
        """For JSON."""
        return asdict(self)


def verdict(every: bool, some: bool = False) -> str:
    """CONFIRMED where `every` part of a statement holds, IN_PART where `some` does."""
    return CONFIRMED if every else IN_PART if some else NOT_CONFIRMED


def judged(judges: Iterable[Callable[[Found], Said]], found: Found) -> list[Said]:
    """What judges say of what was found; those that miss something in it (KeyError) say nothing."""
    statements = []
    for judge in judges:
        try:
            statements.append(judge(found))
        except KeyError:
            continue
    return statements
