"""Reads a YAML file into a dataclass schema, with errors that name file, line, field and range.

Drake's `yaml_load_typed` does the conversion. It neither reports lines nor ranges nor missing
fields, so the YAML nodes are checked against the rules of `fields` first.
"""

from __future__ import annotations

import dataclasses
import math
import re
import types
import typing
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import yaml

from cdpr_drake.errors import DataFileError, Problems, meant_names, why_not_read
from cdpr_drake.schema.fields import NAMED, FieldRule
from cdpr_drake.schema.input_files import input_text
from cdpr_drake.schema.yaml_files import (
    YamlTextError,
    cached_yaml,
    compose_yaml,
    other_kind,
    too_many_bytes,
    too_many_nodes,
)


def printable(words: str) -> str:
    """The words as they are, or quoted with escapes where they would break the line."""
    return words if words.isprintable() else repr(words)


def show(node: yaml.Node) -> str:
    """A node as it could stand in a file, cut to 60 characters."""
    if isinstance(node, yaml.ScalarNode):
        words = printable(str(node.value)) or "nothing"
    elif too_many_nodes(node):
        words = "very many values"
    else:
        words = printable(_flow(node))
    return words if len(words) <= 60 else words[:57] + "..."


def _flow(node: yaml.Node) -> str:
    if isinstance(node, yaml.SequenceNode):
        return "[" + ", ".join(_flow(child) for child in node.value) + "]"
    if isinstance(node, yaml.MappingNode):
        return "{" + ", ".join(f"{_flow(k)}: {_flow(v)}" for k, v in node.value) + "}"
    return str(node.value)


T = TypeVar("T")

_TAG = "tag:yaml.org,2002:"
_NULL_TAG = _TAG + "null"
_BOOLEANS = yaml.SafeLoader.bool_values

_SCALARS = frozenset(_TAG + name for name in ("str", "int", "float", "bool", "null", "timestamp",
                                              "value", "merge"))  # fmt: skip
"""What YAML takes plain words for; another tag was written there."""

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
"""What controls a terminal and no figure can draw; ends of lines and tabs are text."""


def closest(name: str, known: Iterable[str]) -> str:
    """Words that help after an unknown name: the likely one, then all that exist."""
    names = list(known)
    hint = "".join(f"did you mean {likely}? " for likely in meant_names(name, names))
    return f"{hint}known: {', '.join(names)}"


def load_typed(
    schema: type[T],
    path: Path,
    *,
    error: type[DataFileError] = DataFileError,
    overrides: Sequence[str] = (),
) -> T:
    """Reads `path` into an instance of the dataclass `schema`.

    Args:
        schema: Dataclass whose fields were made by `fields`.
        path: YAML file.
        error: Class of the error to raise.
        overrides: Items "key.subkey=value" that replace what the file says; the value is YAML.

    Raises:
        error: The file cannot be read or parsed, a key is unknown or missing, a value has the wrong
            shape, is not finite or lies outside the accepted range. It has every such problem of
            the file and the overrides.
    """
    try:
        large = too_many_bytes(path)
        if large:
            raise error(f"{path}: {large}")
        content = input_text(path)
    except (OSError, UnicodeDecodeError) as problem:
        raise error(f"{path}: cannot be read: {why_not_read(problem)}") from problem
    return parse_typed(schema, content, path, error=error, overrides=overrides)


def parse_typed(
    schema: type[T],
    content: str,
    path: Path,
    *,
    error: type[DataFileError] = DataFileError,
    overrides: Sequence[str] = (),
) -> T:
    """As `load_typed`, of YAML that is there already.

    Args:
        schema: Dataclass whose fields were made by `fields`.
        content: The YAML.
        path: The file that messages name.
        error: Class of the error to raise.
        overrides: As for `load_typed`.

    Raises:
        error: As `load_typed`.
    """
    known = cached_yaml(schema, content, edited=bool(overrides))
    keys = rules_of(typing.cast(type, schema))
    try:
        root = known.nodes()
    except YamlTextError as problem:
        raise error(problem.at(path)) from problem
    if not isinstance(root, yaml.MappingNode):
        raise error(f"{path}: found no mapping at the top; accepted: the keys {', '.join(keys)}")
    elsewhere = other_kind([str(key.value) for key, _ in root.value], keys)
    if elsewhere:
        raise error(f"{path}: {elsewhere}")
    origins: dict[int, str] = {}
    problems = Problems(error)
    try:
        for item in overrides:
            try:
                origin, node = _override(schema, root, item, error)
            except error as problem:
                problems.add(*problem.problems)
            else:
                _mark_origin(node, origin, origins)
        _Checker(path, problems, origins).section(schema, root, "")
        problems.raise_any()
        return typing.cast(T, known.instance())
    except BaseException as problem:
        known.forget()
        if isinstance(problem, RecursionError):
            words = "nested too deeply, or an anchor that contains itself"
            raise error(f"{path}: {words}") from problem
        raise


_RULES: dict[type, dict[str, tuple[FieldRule, Any]]] = {}


def rules_of(schema: type) -> dict[str, tuple[FieldRule, Any]]:
    """The fields of a schema, each with its rule and the type inside Optional and list.

    Found once for each schema, and not to be changed: what its types are called is looked up by
    `typing.get_type_hints`, which takes half of the time of a file that was read before.
    """
    if schema not in _RULES:
        hints, fields = typing.get_type_hints(schema), dataclasses.fields(schema)
        found = {f.name: (f.metadata["rule"], _bare_type(hints[f.name])) for f in fields}
        _RULES[schema] = found
    return _RULES[schema]


def _bare_type(hint: Any) -> Any:
    """The type inside Optional[...], list[...] or dict[str, ...]; other hints as they are."""
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        hint = next(a for a in typing.get_args(hint) if a is not type(None))
    if typing.get_origin(hint) is list:
        hint = typing.get_args(hint)[0]
    if typing.get_origin(hint) is dict:
        hint = typing.get_args(hint)[1]
    return hint


def _find(node: yaml.MappingNode, key: str) -> int | None:
    for index, (name, _) in enumerate(node.value):
        if name.value == key:
            return index
    return None


def _override(
    schema: type, root: yaml.MappingNode, item: str, error: type[DataFileError]
) -> tuple[str, yaml.Node]:
    """Edits the node graph in place as an override key.subkey=value asks.

    Returns:
        Words that say where the value comes from, and the new node.
    """
    key, equals, value = item.partition("=")
    key = key.strip()
    if not equals or not key:
        raise error(f"overrides {printable(item)}: accepted: key=value, as in seed=3")
    node, here = root, schema
    names = key.split(".")
    for depth, name in enumerate(names[:-1]):
        rule, bare = _known_rule(here, names, depth, error)
        if rule.kind != "section":
            raise error(f"overrides {key}: {'.'.join(names[: depth + 1])} has no keys of its own")
        index = _find(node, name)
        child = None if index is None else node.value[index][1]
        if not isinstance(child, yaml.MappingNode):
            child = yaml.MappingNode("tag:yaml.org,2002:map", [])
            _put(node, name, child)
        node, here = child, bare
    _known_rule(here, names, len(names) - 1, error)
    try:
        new = compose_yaml(value)
    except YamlTextError as problem:
        words = repr(value) if len(value) <= 60 else f"{value[:57]!r}..."
        known = problem.line is not None  # where it stops to be YAML
        what = f"found {words}, which is not YAML" if known else str(problem)
        raise error(f"overrides {key}: {what}") from problem
    if new is None:
        new = yaml.ScalarNode(_NULL_TAG, "null")
    _put(node, names[-1], new)
    return f"overrides {key}", new


def _known_rule(
    schema: type, names: list[str], depth: int, error: type[DataFileError]
) -> tuple[FieldRule, Any]:
    """Rule and type of the key `names[depth]`, which must be one of the schema's."""
    rules = rules_of(schema)
    if names[depth] not in rules:
        where = ".".join(names[:depth]) or "the scenario"
        raise error(
            f"overrides {printable('.'.join(names))}: there is no key {printable(names[depth])} "
            f"in {printable(where)}; "
            f"{closest(names[depth], rules)}"
        )
    return rules[names[depth]]


def _put(node: yaml.MappingNode, key: str, value: yaml.Node) -> None:
    """Sets or appends a key of a mapping node."""
    index = _find(node, key)
    if index is None:
        node.value.append((yaml.ScalarNode("tag:yaml.org,2002:str", key), value))
    else:
        node.value[index] = (node.value[index][0], value)


def _mark_origin(node: yaml.Node, origin: str, origins: dict[int, str]) -> None:
    """Notes for a node and all below it, by identity, where they come from if not from the file."""
    origins[id(node)] = origin
    if isinstance(node, yaml.SequenceNode):
        children = node.value
    elif isinstance(node, yaml.MappingNode):
        children = [child for pair in node.value for child in pair]
    else:
        children = []
    for child in children:
        _mark_origin(child, origin, origins)


class _Checker:
    """Walks YAML nodes along a schema and notes what is not accepted."""

    def __init__(self, path: Path, problems: Problems, origins: dict[int, str]) -> None:
        self._path = path
        self._problems = problems
        self._origins = origins

    def fail(self, node: yaml.Node | None, key: str, problem: str) -> None:
        origin = self._origins.get(id(node))
        if origin is not None:
            inner = "" if origin == f"overrides {key}" else f"{key}: "
            self._problems.add(f"{origin}: {inner}{problem}")
            return
        mark = None if node is None else node.start_mark
        line = "" if mark is None else f":{mark.line + 1}"
        self._problems.add(f"{self._path}{line}: {key + ': ' if key else ''}{problem}")

    def section(self, schema: type, node: yaml.Node, key: str) -> None:
        if not isinstance(node, yaml.MappingNode) or node.tag != _TAG + "map":
            self.fail(node, key, f"found {show(node)}; accepted: a mapping")
            return
        rules = rules_of(schema)
        seen: set[str] = set()
        meant: set[str] = set()
        for name_node, child in node.value:
            name = show(name_node)
            name_node.tag = _TAG + "str"  # a key such as `on` is a word, not a switch
            full = f"{key}.{name}" if key else name
            if name not in rules:
                self.fail(name_node, full, f"unknown key; {closest(name, rules)}")
                meant.update(meant_names(name, rules))
            elif name in seen:
                self.fail(name_node, full, "found twice; accepted: once")
            else:
                seen.add(name)
                rule, bare = rules[name]
                self.value(rule, bare, child, full)
        for name, (rule, _) in rules.items():
            if rule.required and name not in seen | meant:
                full = f"{key}.{name}" if key else name
                self.fail(node, full, f"missing; accepted: {rule.accepts()}")

    def value(self, rule: FieldRule, bare: Any, node: yaml.Node, key: str) -> None:
        if node.tag == _NULL_TAG:
            if not rule.nullable:
                self.fail(node, key, f"found null; accepted: {rule.accepts()}")
        elif rule.kind == "section":
            self.section(bare, node, key)
        elif rule.kind in ("sections", "texts"):
            if not _is_list(node):
                self.fail(node, key, f"found {show(node)}; accepted: {rule.accepts()}")
                return
            for index, child in enumerate(node.value):
                if rule.kind == "sections":
                    self.section(bare, child, f"{key}[{index}]")
                else:
                    self.scalar(dataclasses.replace(rule, kind="text"), child, f"{key}[{index}]")
        elif rule.kind in NAMED:
            self.named(rule, bare, node, key)
        elif rule.kind == "array":
            self.numbers(rule, node, key, rule.shape)
        else:
            self.scalar(rule, node, key)

    def named(self, rule: FieldRule, bare: Any, node: yaml.Node, key: str) -> None:
        if not isinstance(node, yaml.MappingNode) or node.tag != _TAG + "map":
            self.fail(node, key, f"found {show(node)}; accepted: {rule.accepts()}")
            return
        seen: set[str] = set()
        for k, (name_node, child) in enumerate(node.value):
            full = f"{key}.{show(name_node)}"
            if not isinstance(name_node, yaml.ScalarNode):
                self.fail(name_node, full, "found no name; accepted: a name")
                continue
            name_node.tag = _TAG + "str"
            if name_node.value in seen:
                self.fail(name_node, full, "found twice; accepted: once")
            seen.add(name_node.value)
            if rule.kind == "named_sections":
                self.section(bare, child, full)
            elif rule.kind == "named_texts":
                self.scalar(dataclasses.replace(rule, kind="text"), child, full)
            else:
                if isinstance(child, yaml.ScalarNode):  # one number is a list of one
                    child = yaml.SequenceNode(
                        _TAG + "seq", [child], child.start_mark, child.end_mark, flow_style=True
                    )
                    node.value[k] = (name_node, child)
                one = dataclasses.replace(rule, kind="array", shape=(None,))
                self.numbers(one, child, full, one.shape)

    def numbers(
        self, rule: FieldRule, node: yaml.Node, key: str, shape: tuple[int | None, ...]
    ) -> None:
        if not shape:
            self.scalar(rule, node, key)
            return
        wrong = not _is_list(node) or not node.value
        if wrong or (shape[0] is not None and len(node.value) != shape[0]):
            self.fail(node, key, f"found {show(node)}; accepted: {rule.accepts()}")
            return
        for index, child in enumerate(node.value):
            self.numbers(rule, child, f"{key}[{index}]", shape[1:])

    def scalar(self, rule: FieldRule, node: yaml.Node, key: str) -> None:
        if not _convert(rule, node):
            plain = rule.kind == "text" and not rule.pattern and not rule.choices
            if plain and _CONTROL.search(str(node.value)):
                self.fail(node, key, f"found {show(node)}; accepted: no control characters")
                return
            if isinstance(node, yaml.ScalarNode) and node.tag not in _SCALARS:
                tag = node.tag.replace(_TAG, "!!")[:80]
                self.fail(node, key, f"found the tag {tag}; accepted: a value without one")
                return
            found = node.value if isinstance(node, yaml.ScalarNode) else ""
            hint = "".join(f"did you mean {name}? " for name in meant_names(found, rule.choices))
            self.fail(node, key, f"found {show(node)}; {hint}accepted: {rule.accepts(found)}")


def _convert(rule: FieldRule, node: yaml.Node) -> bool:
    """Makes a node say what was checked, however YAML would read it; False where it is not
    accepted."""
    if not isinstance(node, yaml.ScalarNode) or node.tag not in _SCALARS:
        return False
    if rule.kind == "text":
        if _CONTROL.search(node.value):
            return False
        if rule.choices and node.value not in rule.choices:
            return False
        if rule.pattern and not re.fullmatch(rule.pattern, node.value):
            return False
        node.tag = _TAG + "str"  # also where YAML reads a number or a switch
    elif rule.kind == "switch":
        return node.tag == _TAG + "bool" and node.value.lower() in _BOOLEANS
    else:
        value = _as_number(node.value)
        if not rule.in_range(value) or (rule.kind == "whole" and value != int(value)):
            return False
        # Such as 1e3 and 010.
        if rule.kind == "whole":
            node.tag, node.value = _TAG + "int", str(int(value))
        else:
            node.tag, node.value = _TAG + "float", repr(value)
    return True


def _is_list(node: yaml.Node) -> bool:
    return isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq"


def _as_number(words: str) -> float:
    try:
        return float(words)
    except ValueError:
        return math.nan
