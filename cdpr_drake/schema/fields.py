"""Fields of YAML schemas that carry their unit, accepted range and documentation line."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import KW_ONLY, Field, dataclass, field
from typing import Any

import numpy as np

SMALLEST, LARGEST = 1e-100, 1e30
"""Sizes of numbers but zero in any unit; squares and cubes of others are no floats any more."""


NAMED = {"named_numbers": "numbers", "named_texts": "texts", "named_sections": "mappings"}
"""Kinds of fields whose keys are names that a user chose, with what stands behind each."""


@dataclass(frozen=True)
class FieldRule:
    """What a schema field accepts; stored as `metadata["rule"]` of the dataclass field.

    `shape` uses None for a free dimension, as in (None, 3). The bounds apply to each number.
    """

    doc: str
    kind: str
    _: KW_ONLY
    unit: str = ""
    required: bool = False
    nullable: bool = False
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    shape: tuple[int | None, ...] = ()
    choices: Collection[str] = ()
    pattern: str = ""

    def accepts(self, found: str = "") -> str:
        """Words for the accepted values, such as `a number > 0 [kg]`.

        Args:
            found: What was found in their place; a number of a size without sense adds words.
        """
        if self.kind == "text":
            words = "one of " + ", ".join(self.choices) if self.choices else "text"
            if self.pattern:
                words = "1 to 64 letters, digits, _ . -, the first one no ."
        elif self.kind == "texts":
            words = "a list of " + (", ".join(self.choices) if self.choices else "texts")
        elif self.kind == "switch":
            words = "true or false"
        elif self.kind == "section":
            words = "a mapping"
        elif self.kind == "sections":
            words = "a list of mappings"
        elif self.kind in NAMED:
            words = f"a mapping from names to {NAMED[self.kind]}"
        else:
            words = {"number": "a number", "whole": "a whole number"}.get(self.kind, "")
            if self.kind == "array":
                size = " x ".join("n" if n is None else str(n) for n in self.shape)
                words = f"{size} numbers"
            bounds = [
                f"{sign} {value:g}"
                for sign, value in (
                    (">", self.above),
                    (">=", self.at_least),
                    ("<", self.below),
                    ("<=", self.at_most),
                )
                if value is not None
            ]
            words = " ".join([words, " and ".join(bounds)]).strip()
            if self.unit:
                words += f" [{self.unit}]"
            if _is_without_sense(found):
                words += f", 0 or of a size from {SMALLEST:g} to {LARGEST:g}"
        return words + (" or null" if self.nullable else "")

    def in_range(self, value: float) -> bool:
        """Whether one number is zero or of a size that has sense, and within the bounds."""
        return (
            _has_sense(value)
            and (self.above is None or value > self.above)
            and (self.at_least is None or value >= self.at_least)
            and (self.below is None or value < self.below)
            and (self.at_most is None or value <= self.at_most)
        )


FASTEST = 1e5
"""Largest rate of images, control steps and rows of a log [Hz]; nothing here is sampled faster."""


def _has_sense(value: float) -> bool:
    return value == 0.0 or SMALLEST <= abs(value) <= LARGEST


def _is_without_sense(words: str) -> bool:
    """Whether words are a number that is finite and of no sensible size."""
    try:
        value = float(words)
    except ValueError:
        return False
    return math.isfinite(value) and not _has_sense(value)


NAME = r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}"
"""Names of scenarios, robots, cables and the like."""


class _Required:
    """Marks a field that a file must give."""


REQUIRED = _Required()


FIELDS_HEAD = "Attributes:"
"""What stands above the fields in the docstring of a class with a schema."""


class _DocumentedField(Field):  # type: ignore[type-arg]
    """A field that adds its words, unit and range to the docstring of its class, for `help`.

    The first one of a class adds those of inherited fields before.
    """

    __slots__ = ()

    def __set_name__(self, owner: type, name: str) -> None:
        super().__set_name__(owner, name)
        known = (owner.__doc__ or f"{owner.__name__}.").rstrip()
        rules: dict[str, FieldRule] = {}
        if FIELDS_HEAD not in known:
            known += f"\n\n    {FIELDS_HEAD}"
            for base in reversed(owner.__mro__[1:]):
                fields = getattr(base, "__dataclass_fields__", {}).values()
                rules |= {
                    one.name: one.metadata["rule"] for one in fields if "rule" in one.metadata
                }
            own = inspect.get_annotations(owner)
            rules = {each: rule for each, rule in rules.items() if each not in own}
        for each, rule in (rules | {name: self.metadata["rule"]}).items():
            known += f"\n        {each}: {rule.doc} Accepted: {rule.accepts()}."
        owner.__doc__ = known


def _make(rule: dict[str, Any], default: Any, placeholder: Any) -> Any:
    required = isinstance(default, _Required)
    made = FieldRule(required=required, nullable=default is None, **rule)
    value = placeholder if required else default
    if isinstance(value, (np.ndarray, list)) or callable(value):
        factory = value if callable(value) else lambda: value.copy()
        new = field(default_factory=factory, metadata={"rule": made})
    else:
        new = field(default=value, metadata={"rule": made})
    new.__class__ = _DocumentedField
    return new


def number(doc: str, unit: str, default: Any = REQUIRED, **bounds: float) -> Any:
    """A real number; `bounds` are above, at_least, below, at_most. Default None: null-able."""
    return _make({"doc": doc, "kind": "number", "unit": unit, **bounds}, default, math.nan)


def whole(doc: str, default: Any = REQUIRED, unit: str = "", **bounds: float) -> Any:
    """A whole number; `bounds` as for `number`."""
    return _make({"doc": doc, "kind": "whole", "unit": unit, **bounds}, default, -1)


def array(
    doc: str, unit: str, shape: tuple[int | None, ...], default: Any = REQUIRED, **bounds: float
) -> Any:
    """An array of real numbers of the given shape (None: any); `bounds` hold for each number."""
    start = (
        default if default is None or isinstance(default, _Required) else np.array(default, float)
    )
    empty = np.full([1 if n is None else n for n in shape], np.nan)
    rule = {"doc": doc, "kind": "array", "unit": unit, "shape": shape, **bounds}
    return _make(rule, start, empty)


def text(doc: str, default: Any = REQUIRED, choices: Collection[str] = ()) -> Any:
    """A text; with `choices`, one of them. A table in their place counts with what it has later."""
    return _make({"doc": doc, "kind": "text", "choices": _listed(choices)}, default, "")


def file_name(doc: str) -> Any:
    """A name that may become that of a file: no folders, no dots at its start."""
    return _make({"doc": doc, "kind": "text", "pattern": NAME}, REQUIRED, "")


def texts(doc: str, choices: Collection[str] = ()) -> Any:
    """A list of texts, by default empty; with `choices`, as for `text`, each one of them."""
    return _make({"doc": doc, "kind": "texts", "choices": _listed(choices)}, [], [])


def _listed(choices: Collection[str]) -> Collection[str]:
    return choices if isinstance(choices, Mapping) else tuple(choices)


def switch(doc: str, default: bool) -> Any:
    """True or false."""
    return _make({"doc": doc, "kind": "switch"}, default, False)


def section(doc: str, schema: Callable[[], Any], required: bool = True) -> Any:
    """A nested mapping of the dataclass `schema`; `required=False` fills it with its defaults."""
    default = REQUIRED if required else schema
    return _make({"doc": doc, "kind": "section"}, default, schema)


def optional_section(doc: str) -> Any:
    """A nested mapping that may be left out (None)."""
    return _make({"doc": doc, "kind": "section"}, None, None)


def sections(doc: str, required: bool = True) -> Any:
    """A list of nested mappings."""
    return _make({"doc": doc, "kind": "sections"}, REQUIRED if required else [], [])


def named_numbers(doc: str, unit: str) -> Any:
    """A mapping from names to numbers, one or a list for each, arrays of shape (n,)."""
    return _make({"doc": doc, "kind": "named_numbers", "unit": unit}, dict, dict)


def named_texts(doc: str) -> Any:
    """A mapping from names to texts."""
    return _make({"doc": doc, "kind": "named_texts"}, dict, dict)


def named_sections(doc: str) -> Any:
    """A mapping from names to nested mappings."""
    return _make({"doc": doc, "kind": "named_sections"}, dict, dict)
