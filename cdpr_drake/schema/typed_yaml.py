"""Reads YAML files into settings, and names every problem with file, line and key.

PyYAML knows lines, pydantic checks values, their rules say in words what they may be, and sections
refuse combinations of fields.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
import yaml

from cdpr_drake.errors import MOST_PROBLEMS, DataFileError, Problems, meant_names, why_not_read
from cdpr_drake.schema.declarations import Scope, Setting, settings_of
from cdpr_drake.schema.input_files import input_text
from cdpr_drake.schema.yaml_files import (
    YamlTextError,
    compose_yaml,
    other_kind,
    too_many_bytes,
    too_many_nodes,
)

T = TypeVar("T")

Place = tuple[str | int, ...]
"""Keys and indices that lead to a value of a file."""

_TAG = "tag:yaml.org,2002:"
_SCALARS = frozenset({"str", "int", "float", "bool", "null", "timestamp", "value", "merge"})
"""Tags that YAML gives plain words; any other tag is written in the file."""

_UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden")


def load_typed(
    schema: type[T],
    path: Path,
    *,
    error: type[DataFileError] = DataFileError,
    overrides: Sequence[str] = (),
    scope: Callable[[T], Scope] | None = None,
) -> T:
    """Reads a file into settings.

    Args:
        schema: Class made by `settings`.
        path: YAML file.
        error: Class of the error to raise.
        overrides: Items "key.subkey=value" that replace what the file says; the value is YAML.
        scope: Gives the surroundings of the settings that were read, and may complete them; None:
            their `refusals` are not asked.

    Raises:
        error: The file cannot be read or parsed, a key is unknown or missing, a value has the wrong
            shape, is not finite or lies outside the accepted range; or sections refuse what they
            say together. It has every such problem of the file and the overrides.
    """
    try:
        large = too_many_bytes(path)
        if large:
            raise error(f"{path}: {large}")
        content = input_text(path)
    except (OSError, UnicodeDecodeError) as problem:
        raise error(f"{path}: cannot be read: {why_not_read(problem)}") from problem
    return parse_typed(schema, content, path, error=error, overrides=overrides, scope=scope)


def parse_typed(
    schema: type[T],
    content: str,
    path: Path,
    *,
    error: type[DataFileError] = DataFileError,
    overrides: Sequence[str] = (),
    scope: Callable[[T], Scope] | None = None,
    lines: bool = True,
) -> T:
    """As `load_typed`, from text.

    Args:
        schema: As for `load_typed`.
        content: The YAML.
        path: The file that messages name.
        error: As for `load_typed`.
        overrides: As for `load_typed`.
        scope: As for `load_typed`.
        lines: True if the YAML is the content of that file, so that messages name its lines.

    Raises:
        error: As `load_typed`.
    """
    known = settings_of(schema)
    try:
        root = _nodes(content)
    except YamlTextError as problem:
        raise error(problem.at(path)) from problem
    if not isinstance(root, yaml.MappingNode):
        raise error(f"{path}: found no mapping at the top; accepted: the keys {', '.join(known)}")
    elsewhere = other_kind([str(key.value) for key, _ in root.value], known)
    if elsewhere:
        raise error(f"{path}: {elsewhere}")
    problems = _Problems(error, path, root if lines else None)
    data = _words(root, problems, ())
    problems.data, problems.schema = data, schema
    for item in overrides:
        _override(schema, data, item, problems)
    from pydantic import ValidationError

    try:
        made: T = _adapter(cast(Any, schema)).validate_python(data)
    except ValidationError as problem:
        problems.add_all(problem.errors(include_url=False, include_context=False))
    problems.raise_any()
    if scope is not None:
        problems.add_refusals(made, scope(made))
        problems.raise_any()
    return made


def refuse(
    settings: Any,
    key: str = "",
    *,
    path: Path | None = None,
    robot: Any = None,
    error: type[DataFileError] = DataFileError,
) -> None:
    """Raises the refusals of settings that code made, or a file of another tool.

    Args:
        settings: The settings.
        key: The key of a section in a file, for the message.
        path: File for the message.
        robot: The robot of the section; None: its refusals need none.
        error: Class of the error to raise.

    Raises:
        error: With every refusal.
    """
    problems = _Problems(error, path, None)
    problems.add_refusals(settings, Scope(settings, path, robot), (key,) if key else ())
    problems.raise_any()


@lru_cache(32)
def _nodes(content: str) -> yaml.Node | None:
    """Nodes, which nobody changes, of files that are read repeatedly."""
    return compose_yaml(content)


@cache
def _adapter(schema: Any) -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(schema)


def dump_typed(settings: Any) -> str:
    """Settings as YAML, which `load_typed` reads back; what is None is left out."""
    words = yaml.dump(
        _rows(plain_values(settings)),
        Dumper=_Dumper,
        sort_keys=False,
        allow_unicode=True,
        width=100,
    )
    return str(words)


def plain_values(settings: Any) -> dict[str, Any]:
    """Copies of settings as mappings, lists, words and numbers; None is left out."""
    values = {field.name: getattr(settings, field.name) for field in dataclasses.fields(settings)}
    return {name: plain_value(value) for name, value in values.items() if value is not None}


def plain_value(value: Any) -> Any:
    """A copy of a setting as mappings, lists, words and numbers."""
    if dataclasses.is_dataclass(value):
        return plain_values(value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain_value(item) for item in value]
    if isinstance(value, dict):
        return {name: plain_value(item) for name, item in value.items()}
    return value


class _Row(list[float]):
    """Numbers of one line."""


class _Dumper(yaml.SafeDumper):
    """PyYAML's, with lists of numbers in a line."""


_Dumper.add_representer(
    _Row, lambda dumper, row: dumper.represent_sequence(_TAG + "seq", row, flow_style=True)
)


def _rows(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _rows(item) for name, item in value.items()}
    if isinstance(value, list):
        is_row = not any(isinstance(item, dict | list | str) for item in value)
        return _Row(value) if is_row else [_rows(item) for item in value]
    return value


class _Word(str):
    """A scalar as it stands in a file, with its tag."""

    tag = ""


def _words(node: yaml.Node, problems: _Problems, place: Place) -> Any:
    """What nodes say: scalars as words, null as None; what has another tag stays a node."""
    tag = node.tag.removeprefix(_TAG)
    if isinstance(node, yaml.ScalarNode) and tag in _SCALARS and tag != node.tag:
        word = _Word(node.value)
        word.tag = tag
        return None if tag == "null" else word
    if isinstance(node, yaml.SequenceNode) and tag == "seq":
        return [_words(child, problems, (*place, k)) for k, child in enumerate(node.value)]
    if not isinstance(node, yaml.MappingNode) or tag != "map":
        return node
    data: dict[str, Any] = {}
    for key, child in node.value:
        name = key.value if isinstance(key, yaml.ScalarNode) else shown(key)
        if name in data:
            problems.add((*place, name), "found twice; accepted: once", at_key=True)
        data[name] = _words(child, problems, (*place, name))
    return data


def _override(schema: type, data: dict[str, Any], item: str, problems: _Problems) -> None:
    """Puts "key.subkey=value" into the data of a file."""
    key, equals, value = item.partition("=")
    key = key.strip()
    if not equals or not key:
        problems.note(f"overrides {printable(item)}: accepted: key=value, as in seed=3")
        return
    names = key.split(".")
    here: type = schema
    for depth, name in enumerate(names):
        known = settings_of(here)
        if name not in known:
            where = printable(".".join(names[:depth]) or "the scenario")
            words = f"there is no key {printable(name)} in {where}; {closest(name, known)}"
            problems.note(f"overrides {printable(key)}: {words}")
            return
        section = known[name].section
        if depth < len(names) - 1:
            if section is None or known[name].many:
                inner = ".".join(names[: depth + 1])
                problems.note(f"overrides {key}: {inner} has no keys of its own")
                return
            here = section
    try:
        node = compose_yaml(value)
    except YamlTextError as problem:
        words = repr(value) if len(value) <= 60 else f"{value[:57]!r}..."
        known_line = problem.line is not None  # where it stops to be YAML
        words = f"found {words}, which is not YAML" if known_line else str(problem)
        problems.note(f"overrides {key}: {words}")
        return
    problems.origins[tuple(names)] = f"overrides {key}"
    for name in names[:-1]:
        if not isinstance(data.get(name), dict):
            data[name] = {}
        data = data[name]
    data[names[-1]] = None if node is None else _words(node, problems, tuple(names))


class _Problems:
    """Problems of a file, in the order of its lines."""

    def __init__(
        self, error: type[DataFileError], path: Path | None, root: yaml.Node | None
    ) -> None:
        self.schema: type = object
        self.data: Any = None
        self.origins: dict[Place, str] = {}
        self._error, self._path, self._root = error, path, root
        self._said: list[tuple[float, str]] = []

    def note(self, words: str) -> None:
        """Adds words on no place of the file: on a malformed override, or on another file."""
        self._said.append((-1, words))

    def add(self, place: Place, words: str, at_key: bool = False) -> None:
        """Adds what is wrong with a value, or with its key."""
        key = key_of(place)
        for origin in (place[:n] for n in range(len(place), 0, -1)):
            if origin in self.origins:
                inner = "" if origin == place else f"{key}: "
                self._said.append((math.inf, f"{self.origins[origin]}: {inner}{words}"))
                return
        line = 0
        if self._root is not None:
            line = _nodes_at(self._root, place)[0 if at_key else 1].start_mark.line + 1
        file = "" if self._path is None else f"{self._path}:{line}: " if line else f"{self._path}: "
        self._said.append((line, f"{file}{key + ': ' if key else ''}{words}"))

    def add_all(self, errors: Iterable[Any]) -> None:
        """Adds errors of pydantic, at most `MOST_PROBLEMS`."""
        errors = list(errors)[:MOST_PROBLEMS]
        unknown = [error["loc"] for error in errors if error["type"] in _UNKNOWN]
        meant = {
            (*at[:-1], name)
            for at in unknown
            for name in meant_names(at[-1], settings_of(_owner(self.schema, at)[0]))
        }
        for error in errors:
            place = error["loc"]
            if error["type"] == "missing" and place in meant:
                continue
            self.add(place, self._words(error), error["type"] in _UNKNOWN)

    def add_refusals(self, settings: Any, scope: Scope, within: Place = ()) -> None:
        """Adds what sections refuse; raises their exceptions as `Scope` says.

        All sections are asked first, as one within may explain the exception of an outer one.
        """
        asked = [(at, each.refusals) for at, each in _sections(settings, within)
                 if hasattr(each, "refusals")]  # fmt: skip
        asked += [(within, more) for more in scope.more]
        refused: list[Place] = []
        raised: list[tuple[Place, Exception]] = []
        for place, refusals in asked:
            try:
                for key, found, accepted in refusals(scope):
                    parts = re.findall(r"[^.\[\]/]+", key)
                    at = within if key.startswith("/") else place
                    at = (*at, *(int(part) if part.isdecimal() else part for part in parts))
                    self.add(at, f"found {found}; accepted: {accepted}" if accepted else str(found))
                    refused.append(at)
            except self._error as problem:  # of a file that a section names
                refused.append(place)
                for words in problem.problems:
                    self.note(words)
            except Exception as exception:
                raised.append((place, exception))
        for place, cause in raised:
            if not any(at[: len(place)] == place for at in refused):
                raise cause

    def _words(self, error: Any) -> str:
        section, setting = _owner(self.schema, error["loc"])
        if setting is None:
            return f"unknown key; {closest(error['loc'][-1], settings_of(section))}"
        if error["type"] == "missing":
            return f"missing; accepted: {setting.accepts()}"
        value = self.data
        for part in error["loc"]:
            value = value[part] if isinstance(value, list | dict) else value
        if isinstance(value, yaml.ScalarNode):
            tag = value.tag.replace(_TAG, "!!")[:80]
            return f"found the tag {tag}; accepted: a value without one"
        words, choices = value if isinstance(value, str) else "", setting.choices
        if setting.many and error["loc"][-1] != setting.name:  # one of several
            setting = dataclasses.replace(setting, many=None)
        likely = () if setting.many else meant_names(words, choices)
        hint = "".join(f"did you mean {name}? " for name in likely)
        return f"found {shown(value)}; {hint}accepted: {setting.accepts(words)}"

    def raise_any(self) -> None:
        """Raises an error with all of them."""
        problems = Problems(self._error)
        for _, words in sorted(self._said, key=lambda said: said[0]):
            problems.add(words)
        problems.raise_any()


def _sections(section: Any, place: Place) -> Iterator[tuple[Place, Any]]:
    """A section and all within, each with its place in the file."""
    yield place, section
    for field in dataclasses.fields(section):
        value, at = getattr(section, field.name), (*place, field.name)
        inside: dict[Place, Any] = {at: value}
        if isinstance(value, list):
            inside = {(*at, k): item for k, item in enumerate(value)}
        elif isinstance(value, dict):
            inside = {(*at, name): item for name, item in value.items()}
        for where, item in inside.items():
            if dataclasses.is_dataclass(item):
                yield from _sections(item, where)


def _owner(schema: type, place: Place) -> tuple[type, Setting | None]:
    """The class of the section that a place lies in, and its setting; None: an unknown key."""
    setting = settings_of(schema).get(str(place[0]))
    rest = place[2:] if setting is not None and setting.many else place[1:]
    if rest and setting is not None and setting.section:
        return _owner(setting.section, rest)
    return schema, setting


def _nodes_at(root: yaml.Node, place: Place) -> tuple[yaml.Node, yaml.Node]:
    """The nodes of key and value of a place, or of the nearest one around it."""
    key = node = root
    for part in place:
        if isinstance(node, yaml.SequenceNode) and isinstance(part, int):
            key = node = node.value[part]
        elif isinstance(node, yaml.MappingNode):
            found = [pair for pair in node.value if shown(pair[0]) == part or pair[0].value == part]
            if not found:
                break
            key, node = found[-1]
    return key, node


def closest(name: str, known: Iterable[str]) -> str:
    """Words after an unknown name: the likely one, then all known ones."""
    names = list(known)
    hint = "".join(f"did you mean {likely}? " for likely in meant_names(name, names))
    return f"{hint}known: {', '.join(names)}"


def key_of(place: Place) -> str:
    """A place as keys with dots, and indices in brackets."""
    parts = (f"[{part}]" if isinstance(part, int) else f".{shown(part)}" for part in place)
    return "".join(parts).removeprefix(".")


def printable(words: str) -> str:
    """The words as they are, or quoted with escapes where they would break the line."""
    return words if words.isprintable() else repr(words)


def shown(value: Any) -> str:
    """A value or node as it could stand in a file, cut to 60 characters."""
    if isinstance(value, yaml.Node) and too_many_nodes(value):
        return "very many values"
    words = printable(_flow(value)) or "nothing"
    return words if len(words) <= 60 else words[:57] + "..."


def _flow(value: Any) -> str:
    if isinstance(value, yaml.Node):
        value = dict(value.value) if isinstance(value, yaml.MappingNode) else value.value
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_flow(key)}: {_flow(item)}" for key, item in value.items()) + "}"
    return "null" if value is None else str(value)
