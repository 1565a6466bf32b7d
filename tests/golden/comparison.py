"""What differs between two golden files: key, value before and after, and how much."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MADE_BY = "made by"
"""Key of a golden file that says which code made it; never compared."""


class _Absent:
    def __repr__(self) -> str:
        return "(not there)"


ABSENT = _Absent()


@dataclass(frozen=True)
class Difference:
    """One value that is another one now.

    Attributes:
        file: Golden file, from the folder.
        key: Keys and numbers of items on the way to the value, with / between.
        before: What the golden file has.
        after: What there is now.
    """

    file: str
    key: str
    before: Any
    after: Any

    def relative(self) -> float | None:
        """|after - before| over the larger one; None where one of them is no finite number."""
        pair = (self.before, self.after)
        if not all(_is_number(value) and math.isfinite(value) for value in pair):
            return None
        size = max(abs(value) for value in pair)
        return abs(self.after - self.before) / size if size else 0.0

    def __str__(self) -> str:
        share = self.relative()
        words = "" if share is None else f" (relative {share:.1e})"
        return f"{self.file}: {self.key}: {_short(self.before)} -> {_short(self.after)}{words}"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _short(value: Any) -> str:
    words = repr(value)
    return words if len(words) <= 120 else f"{words[:117]}..."


def differences(file: str, before: Any, after: Any, key: str = "") -> Iterator[Difference]:
    """All values in which two results of JSON differ; equal to the last digit is equal."""
    if isinstance(before, dict) and isinstance(after, dict):
        for name in (*before, *(name for name in after if name not in before)):
            inner = f"{key}/{name}" if key else str(name)
            yield from differences(file, before.get(name, ABSENT), after.get(name, ABSENT), inner)
    elif isinstance(before, list) and isinstance(after, list):
        if len(before) != len(after):
            yield Difference(file, f"{key}/length", len(before), len(after))
        for number, pair in enumerate(zip(before, after, strict=False)):
            yield from differences(file, *pair, f"{key}/{number}")
    elif not _same(before, after):
        yield Difference(file, key, before, after)


def _same(before: Any, after: Any) -> bool:
    if _is_number(before) and _is_number(after):
        return bool(before == after or (math.isnan(before) and math.isnan(after)))
    return type(before) is type(after) and bool(before == after)


def compare_files(file: str, before: Path, after: Path) -> list[Difference]:
    """What differs between a golden file and the same one made now."""
    pair = []
    for path in (before, after):
        kept = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else ABSENT
        if isinstance(kept, dict):
            kept.pop(MADE_BY, None)
        pair.append(kept)
    return list(differences(file, *pair))


def largest_relative(found: list[Difference]) -> float | None:
    """The largest relative difference; None where no two finite numbers differ."""
    shares = [share for one in found if (share := one.relative()) is not None]
    return max(shares, default=None)
