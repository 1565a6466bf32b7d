"""Words of a field, and values of words: what stands in a form, and what a file gets of it.

Nothing is judged here. What is no number stays the words that it is, so that the checks of files,
which `cdpr check` has too, say what they found and what they accept.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cdpr_drake.schema.declarations import Setting

SHORT = 3
"""Arrays of so many numbers that have to be there get a field for each number."""


def field_words(rule: Setting, value: Any) -> str:
    """A value of a schema's field as it stands in a form."""
    if value is None:
        return ""
    if rule.kind == "array":
        return ", ".join(number_text(item) for item in np.ravel(value))
    if rule.kind == "texts":
        return ", ".join(value)
    if rule.kind in ("number", "whole"):
        return number_text(value)
    return str(value)


def number_text(value: Any) -> str:
    """A number with all its digits, without a point where it is whole."""
    number = float(value)
    if number == int(number) and abs(number) < 1e7:
        return str(int(number))
    return repr(number)


def typed_value(rule: Setting, words: str) -> Any:
    """What a file gets of the words in a field; None where there are none and may be none."""
    words = words.strip()
    if not words and rule.nullable:
        return None
    if rule.kind == "array":
        return [typed_number(word) for word in words.replace(",", " ").split()]
    if rule.kind == "texts":
        return [word.strip() for word in words.split(",") if word.strip()]
    if rule.kind in ("number", "whole"):
        return typed_number(words)
    return words


def typed_number(words: str) -> float | int | str:
    """A number of words, or the words where they are none."""
    try:
        return int(words)
    except ValueError:
        pass
    try:
        return float(words)
    except ValueError:
        return words


def in_parts(rule: Setting) -> bool:
    """Whether a field is a row of fields, one for each number."""
    return rule.kind == "array" and rule.shape == (SHORT,) and not rule.nullable


def axis_names(rule: Setting) -> tuple[str, str, str]:
    """Names of the three numbers of a field: along axes, or of angles."""
    return ("phi", "theta", "psi") if rule.unit in ("deg", "rad") else ("x", "y", "z")
