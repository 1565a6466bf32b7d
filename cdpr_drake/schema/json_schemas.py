"""JSON schemas of YAML files, for editors that complete and check while one types.

Source: JSON Schema 2020-12.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from cdpr_drake.schema.fields import FieldRule
from cdpr_drake.schema.typed_yaml import rules_of

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema(schema: type, title: str) -> dict[str, Any]:
    """The JSON schema of a dataclass whose fields were made by `fields`.

    Args:
        schema: The dataclass.
        title: What files of it are, in words.
    """
    return {"$schema": DIALECT, "title": title, **_object(schema)}


def _object(schema: type) -> dict[str, Any]:
    rules = rules_of(schema)
    defaults = {field.name: _default(field) for field in dataclasses.fields(schema)}
    properties = {}
    for name, (rule, bare) in rules.items():
        properties[name] = _property(rule, bare)
        if not rule.required and rule.kind not in ("section", "sections"):
            properties[name]["default"] = defaults[name]
    return {
        "type": "object",
        "properties": properties,
        "required": [name for name, (rule, _) in rules.items() if rule.required],
        "additionalProperties": False,
    }


def _default(field: dataclasses.Field[Any]) -> Any:
    value = field.default
    if field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    return value.tolist() if isinstance(value, np.ndarray) else value


def _property(rule: FieldRule, bare: Any) -> dict[str, Any]:
    if rule.kind == "section":
        made = _object(bare)
    elif rule.kind == "sections":
        made = {"type": "array", "items": _object(bare)}
    elif rule.kind == "named_sections":
        made = {"type": "object", "additionalProperties": _object(bare)}
    elif rule.kind == "named_texts":
        made = {"type": "object", "additionalProperties": {"type": "string"}}
    elif rule.kind == "named_numbers":
        one = _number(rule)
        several = {"type": "array", "items": one, "minItems": 1}
        made = {"type": "object", "additionalProperties": {"anyOf": [one, several]}}
    elif rule.kind == "texts":
        made = {"type": "array", "items": _text(rule)}
    elif rule.kind == "text":
        made = _text(rule)
    elif rule.kind == "switch":
        made = {"type": "boolean"}
    elif rule.kind == "array":
        made = _numbers(rule, rule.shape)
    else:
        made = _number(rule)
    if rule.nullable:
        made = {"anyOf": [made, {"type": "null"}]}
    unit = f" [{rule.unit}]" if rule.unit else ""
    return {"description": f"{rule.doc}{unit}", **made}


def _text(rule: FieldRule) -> dict[str, Any]:
    made: dict[str, Any] = {"type": "string"}
    if rule.choices:
        made["enum"] = list(rule.choices)
    if rule.pattern:
        made["pattern"] = f"^{rule.pattern}$"
    return made


def _number(rule: FieldRule) -> dict[str, Any]:
    bounds = {
        "exclusiveMinimum": rule.above,
        "minimum": rule.at_least,
        "exclusiveMaximum": rule.below,
        "maximum": rule.at_most,
    }
    kind = "integer" if rule.kind == "whole" else "number"
    return {"type": kind} | {key: value for key, value in bounds.items() if value is not None}


def _numbers(rule: FieldRule, shape: tuple[int | None, ...]) -> dict[str, Any]:
    if not shape:
        return _number(rule)
    made: dict[str, Any] = {"type": "array", "items": _numbers(rule, shape[1:])}
    least, most = (1, None) if shape[0] is None else (shape[0], shape[0])
    made["minItems"] = least
    if most is not None:
        made["maxItems"] = most
    return made
