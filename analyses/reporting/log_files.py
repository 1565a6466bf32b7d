"""Writes scenarios, numbers and texts as files that appear whole or not at all."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.schema.typed_yaml import dump_typed


def write_scenario(path: Path, scenario: object) -> None:
    """Writes the scenario as it was run, overrides included, so that it can be run again."""
    write_whole(path, dump_typed(scenario))


def write_json(path: Path, found: dict[str, Any]) -> None:
    """Writes results for other programs; NaN is not accepted there, see `finite`.

    The file appears whole or not at all, see `write_whole`.
    """
    write_whole(path, json.dumps(found, indent=2, allow_nan=False) + "\n")


def write_whole(path: Path, words: str) -> None:
    """Writes a text file that appears whole or not at all; what was there before stays until then.

    Raises:
        OSError: It cannot be written, for instance on a full disk; nothing is left behind.
    """
    with whole_file(path) as part:
        part.write_text(words, encoding="utf-8")


def finite(value: Any) -> Any:
    """A summary in which numbers that are not finite, as a diverged run leaves, are None."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
