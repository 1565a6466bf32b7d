"""Reads JSON of any source: damaged and hostile texts raise one kind of error."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

MOST_DEPTH = 100
"""Levels of brackets or indentation; PyYAML needs three calls for each."""

MOST_DIGITS = 300
"""Of a whole number; more have no place among floating-point numbers."""


def load_json(
    text: str | bytes | bytearray, parse_constant: Callable[[str], Any] | None = None
) -> Any:
    """What a JSON text says; NaN and infinity are read, the last of several equal keys counts.

    Args:
        text: Its letters or bytes.
        parse_constant: Asked for the value of NaN, Infinity and -Infinity; None: those floats.

    Raises:
        json.JSONDecodeError: It is no JSON, has a whole number of more than `MOST_DIGITS` digits,
            or is nested deeper than `MOST_DEPTH`; with the line where that is known.
    """
    if not isinstance(text, str):
        try:
            text = bytes(text).decode(json.detect_encoding(text), "surrogatepass")
        except UnicodeDecodeError as problem:
            raise json.JSONDecodeError("Text that is not UTF-8", "", problem.start) from problem
    words = text

    def whole(digits: str) -> int:
        if len(digits) > MOST_DIGITS:
            more = f"A whole number of more than {MOST_DIGITS} digits"
            raise json.JSONDecodeError(more, words, words.find(digits))
        return int(digits)

    try:
        content = json.loads(words, parse_int=whole, parse_constant=parse_constant)
    except RecursionError as problem:
        raise _too_deep(words) from problem
    if _deeper(content):
        raise _too_deep(words)
    return content


def _too_deep(text: str) -> json.JSONDecodeError:
    return json.JSONDecodeError(f"nested more than {MOST_DEPTH} deep", text, 0)


def _deeper(content: Any) -> bool:
    """Whether lists and objects lie in each other deeper than `MOST_DEPTH`."""
    level = [content]
    for _ in range(MOST_DEPTH + 1):
        holders = [each for each in level if isinstance(each, (dict, list))]
        if not holders:
            return False
        level = [
            inner
            for each in holders
            for inner in (each.values() if isinstance(each, dict) else each)
        ]
    return True
