"""YAML files as dataclasses: fields with unit, range and documentation line, and their loader.

A schema is a dataclass with keyword arguments whose fields come from this room. Errors name file,
line, field, what was found and what is accepted. Drake's loader reads annotations themselves, so a
module with a schema does not postpone them.
"""

from cdpr_drake.schema.fields import (
    FASTEST,
    FieldRule,
    array,
    file_name,
    number,
    optional_section,
    section,
    sections,
    switch,
    text,
    texts,
    whole,
)
from cdpr_drake.schema.json_schemas import json_schema
from cdpr_drake.schema.sizes import too_many_bytes
from cdpr_drake.schema.templates import commented_yaml
from cdpr_drake.schema.typed_yaml import closest, load_typed, parse_typed, rules_of

__all__ = [
    "FASTEST", "FieldRule", "array", "closest", "commented_yaml", "file_name", "json_schema",
    "load_typed", "number", "optional_section", "parse_typed", "rules_of", "section", "sections",
    "switch", "text", "texts", "too_many_bytes", "whole",
]  # fmt: skip
