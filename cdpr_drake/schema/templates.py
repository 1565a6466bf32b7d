"""YAML files to start from: what one has, with a comment on every key that there is."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import yaml

from cdpr_drake.schema.fields import FieldRule
from cdpr_drake.schema.typed_yaml import rules_of

_WIDTH = 100


def commented_yaml(schema: type, content: Mapping[str, Any], every: bool = True) -> str:
    """Content of a file with a comment on each of its keys, and the keys that it lacks as comments.

    Args:
        schema: Dataclass whose fields were made by `fields`.
        content: Keys of the file, as YAML gives them.
        every: False to leave out the keys that the content lacks.
    """
    return "\n".join(_section(schema, content, 0, every)) + "\n"


def _section(schema: type, content: Mapping[str, Any], depth: int, every: bool) -> Iterator[str]:
    pad = "  " * depth
    defaults = {field.name: field for field in dataclasses.fields(schema)}
    for name, (rule, bare) in rules_of(schema).items():
        if not every and name not in content:
            continue
        yield from _comment(rule, pad)
        value = content.get(name)
        if value is None and rule.kind == "section":
            yield f"{pad}# {name}:"
            yield from _section(bare, {}, depth + 1, every)
        elif name not in content:
            yield f"{pad}# {name}: {_shown(rule, defaults[name])}"
        elif rule.kind == "section":
            yield f"{pad}{name}:"
            yield from _section(bare, value or {}, depth + 1, every)
        elif rule.kind == "sections" and value:
            yield f"{pad}{name}:"
            for number, item in enumerate(value):
                if number == 0 and every:
                    yield from (f"{pad}  # {line}" for line in _keys(bare))
                yield f"{pad}  - {_flow(item)}"
        else:
            yield f"{pad}{name}: {_flow(value)}"


def _comment(rule: FieldRule, pad: str) -> Iterator[str]:
    accepts = rule.accepts().rstrip(".")
    accepted = f" {accepts[:1].upper()}{accepts[1:]}."
    plain = rule.kind in ("section", "sections")
    words, line = f"{rule.doc}{'' if plain else accepted}".split(), f"{pad}#"
    for word in words:
        if len(line) + 1 + len(word) > _WIDTH:
            yield line
            line = f"{pad}#  "
        line += f" {word}"
    yield line


def _keys(schema: type) -> Iterator[str]:
    for name, (rule, _) in rules_of(schema).items():
        unit = f" [{rule.unit}]" if rule.unit and rule.unit != "-" else ""
        yield f"{name}: {rule.doc}{unit}"


def _shown(rule: FieldRule, field: dataclasses.Field[Any]) -> str:
    """The default of a key that is not there."""
    if rule.required:
        return "..."
    value = field.default
    if field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    return _flow(value)


def _flow(value: Any) -> str:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    words = yaml.safe_dump(
        value, default_flow_style=True, sort_keys=False, width=10_000, allow_unicode=True
    )
    return words.removesuffix("\n").removesuffix("\n...")
