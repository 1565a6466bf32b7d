"""What files of a class of settings may say: a JSON schema for editors, and a file to start from.

Source: JSON Schema 2020-12.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from textwrap import wrap
from typing import Any

import numpy as np
import yaml

from cdpr_drake.schema.declarations import Setting, settings_of

DIALECT = "https://json-schema.org/draft/2020-12/schema"

_WIDTH = 100


def json_schema(schema: type, title: str) -> dict[str, Any]:
    """The JSON schema of a class of settings; `title` says what files of it are, in words."""
    return {"$schema": DIALECT, "title": title, **_object(schema)}


def _object(schema: type) -> dict[str, Any]:
    known = settings_of(schema)
    return {
        "type": "object",
        "properties": {name: _property(setting) for name, setting in known.items()},
        "required": [name for name, setting in known.items() if setting.required],
        "additionalProperties": False,
    }


def _property(setting: Setting) -> dict[str, Any]:
    made = setting.rule.json(setting.type) if setting.rule else _object(setting.section)
    if setting.many is list:
        made = {"type": "array", "items": made}
    elif setting.many is dict:
        made = {"type": "object", "additionalProperties": made}
    if setting.nullable:
        made = {"anyOf": [made, {"type": "null"}]}
    unit = f" [{setting.unit}]" if setting.unit else ""
    made = {"description": f"{setting.doc}{unit}", **made}
    if not setting.required and setting.kind not in ("section", "sections"):
        made["default"] = _default(setting)
    return made


def _default(setting: Setting) -> Any:
    value = setting.default
    return value.tolist() if isinstance(value, np.ndarray) else value


def commented_yaml(schema: type, content: Mapping[str, Any], every: bool = True) -> str:
    """Content of a file with a comment on each of its keys, and the keys that it lacks as comments.

    Args:
        schema: Class of settings.
        content: Keys of the file, as YAML gives them.
        every: False to leave out the keys that the content lacks.
    """
    return "\n".join(_lines(schema, content, "", every)) + "\n"


def _lines(schema: type, content: Mapping[str, Any], pad: str, every: bool) -> Iterator[str]:
    for name, setting in settings_of(schema).items():
        if not every and name not in content:
            continue
        words, value = setting.doc, content.get(name)
        if setting.kind not in ("section", "sections"):
            accepts = setting.accepts().rstrip(".")
            words += f" {accepts[:1].upper()}{accepts[1:]}."
        yield from wrap(words, _WIDTH, initial_indent=f"{pad}# ", subsequent_indent=f"{pad}#   ",
                        break_long_words=False, break_on_hyphens=False)  # fmt: skip
        if setting.kind == "section":
            yield f"{pad}{'# ' if value is None else ''}{name}:"
            yield from _lines(setting.section, value or {}, f"{pad}  ", every)
        elif name not in content:
            yield f"{pad}# {name}: {'...' if setting.required else _flow(_default(setting))}"
        elif setting.kind == "sections" and value:
            yield f"{pad}{name}:"
            if every:
                yield from (f"{pad}  # {line}" for line in _keys(setting.section))
            yield from (f"{pad}  - {_flow(item)}" for item in value)
        else:
            yield f"{pad}{name}: {_flow(value)}"


def _keys(schema: type) -> Iterator[str]:
    for name, setting in settings_of(schema).items():
        unit = f" [{setting.unit}]" if setting.unit not in ("", "-") else ""
        yield f"{name}: {setting.doc}{unit}"


def _flow(value: Any) -> str:
    words = yaml.safe_dump(
        value, default_flow_style=True, sort_keys=False, width=10_000, allow_unicode=True
    )
    return words.removesuffix("\n").removesuffix("\n...")
