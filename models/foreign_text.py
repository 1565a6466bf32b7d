"""What all readers share: text, numbers and names, with errors of one line each."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError
from cdpr_drake.schema.declarations import LARGEST, NAME
from cdpr_drake.schema.input_files import input_bytes, input_size
from cdpr_drake.schema.json_text import load_json
from cdpr_drake.schema.yaml_files import YamlTextError, load_yaml

MOST_BYTES = 4_194_304
"""Of a file of another tool; the largest that is known has 60 kB."""

_SHOWN = 40


def read_text(path: Path) -> str:
    """The file's text, UTF-8 or Latin-1, without a byte order mark.

    Raises:
        RobotFileError: It cannot be read, or is larger than `MOST_BYTES`.
    """
    try:
        size = input_size(path)
        if size > MOST_BYTES:
            raise RobotFileError(f"{path}: found {size:,} bytes; accepted: at most {MOST_BYTES:,}")
        content = input_bytes(path)
    except OSError as problem:
        raise RobotFileError(f"{path}: cannot be read: {problem.strerror}") from problem
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def read_xml(path: Path) -> ET.Element:
    """The root of an XML file; external entities are not read.

    Raises:
        RobotFileError: The file cannot be read or is not well-formed; names line and column.
    """
    text = re.sub(r"^\s*<\?xml[^>]*\?>", "", read_text(path), count=1)  # decoded already
    try:
        return ET.fromstring(text)
    except ET.ParseError as problem:
        line, column = problem.position
        what = str(problem).partition(":")[0]
        raise RobotFileError(
            f"{path}:{line}: is not well-formed XML: {what} at column {column + 1}"
        ) from problem


_TOKEN = re.compile(
    r'("(?:\\.|[^"\\])*")'  # a string
    r"|(,)(?=\s*[\]}])"  # a comma that nothing but space divides from a closing bracket
    r"|(?<![\w.+-])(-?)(?:(\d+)\.|\.(\d+))((?:[eE][+-]?\d+)?)(?![\w.])"  # digits on one side only
)


def read_json(path: Path) -> tuple[Any, list[str]]:
    """What a JSON file holds, and remarks on what strict JSON refuses and is read here.

    That is commas before a closing bracket, and numbers such as `0.` and `-.5`.

    Raises:
        RobotFileError: The file cannot be read or does not parse; names the line.
    """
    text = read_text(path)
    commas: list[int] = []
    points: list[re.Match[str]] = []

    def strict(found: re.Match[str]) -> str:
        string, comma, sign, whole, after, power = found.groups()
        if string:
            return str(string)
        if comma:
            commas.append(found.start())
            return ""
        points.append(found)
        return f"{sign}{whole or 0}.{after or 0}{power}"

    try:
        content = load_json(_TOKEN.sub(strict, text))
    except json.JSONDecodeError as problem:
        raise RobotFileError(
            f"{path}:{problem.lineno}: does not parse as JSON: {problem.msg}"
        ) from problem

    def line(place: int) -> int:
        return text.count("\n", 0, place) + 1

    remarks = []
    if points:
        first = points[0]
        remarks.append(
            f"Numbers that strict JSON refuses were read: {len(points)}, the first "
            f"{first.group()} in line {line(first.start())}."
        )
    if commas:
        remarks.append(
            f"Commas before a closing bracket were let pass: {len(commas)}, the first in line "
            f"{line(commas[0])}."
        )
    return content, remarks


def read_yaml(path: Path) -> Any:
    """What a YAML file holds.

    Raises:
        RobotFileError: The file cannot be read or does not parse; names the line.
    """
    try:
        return load_yaml(read_text(path))
    except YamlTextError as problem:
        raise RobotFileError(problem.at(path)) from problem


JSON_WORDS = {
    dict: "an object", list: "an array", str: "a string", bool: "true or false",
    int: "a number", float: "a number", type(None): "null",
}  # fmt: skip
YAML_WORDS = JSON_WORDS | {dict: "a mapping", list: "a sequence", str: "text"}
"""What the types of a document are called in its format."""


def kind_of(content: object, words: dict[type, str]) -> str:
    """What a document is, in the words of its format, with the keys that it has."""
    kind = words.get(type(content), type(content).__name__)
    if not isinstance(content, dict):
        return kind
    keys = [str(key) for key in content]
    return f"{kind} with {', '.join(keys)}" if keys else f"{kind} without keys"


def fail(path: Path, where: str, found: object, accepted: str) -> RobotFileError:
    """The error of a field: file, field, what was found and what is accepted."""
    if found is None:
        words = ""
    elif isinstance(found, (dict, list, bool)):  # as files have them, not as Python does
        try:
            words = json.dumps(found, ensure_ascii=False, default=str)
        except (TypeError, ValueError):  # keys that are no text; YAML that holds itself
            words = str(found)
        except RecursionError:
            words = "something nested too deeply"
    else:
        words = str(found)
    words = words if words.isprintable() else repr(words)
    if len(words) > _SHOWN:
        words = words[: _SHOWN - 3] + "..."
    return RobotFileError(f"{path}: {where}: found {words or 'nothing'}; accepted: {accepted}")


def number(path: Path, where: str, value: object) -> float:
    """A number of a size that has sense, from text or a number.

    Raises:
        RobotFileError: It is none, such as a placeholder, or is beyond `LARGEST`.
    """
    try:
        result = float(value)  # type: ignore[arg-type]
    except (OverflowError, TypeError, ValueError):
        result = np.nan
    if isinstance(value, bool) or not np.isfinite(result):
        raise fail(path, where, value, "a finite number")
    if abs(result) > LARGEST:
        raise fail(path, where, value, f"a number of at most {LARGEST:g}")
    return result


def numbers(path: Path, where: str, value: object, count: int) -> Array:
    """Finite numbers: a list, a column of lists of one, or text with spaces or commas.

    Raises:
        RobotFileError: They are not `count` finite numbers.
    """
    items: Sequence[object]
    if isinstance(value, str):
        items = value.replace(",", " ").split()
    elif isinstance(value, (list, tuple)):
        items = [v[0] if isinstance(v, list) and len(v) == 1 else v for v in value]
    else:
        items = ()
    if len(items) != count:
        raise fail(path, where, value, f"{count} finite numbers")
    return np.array([number(path, where, item) for item in items])


def child_text(path: Path, parent: ET.Element, name: str, where: str) -> str:
    """The text of a child element.

    Raises:
        RobotFileError: There is no such element, or it is empty.
    """
    child = parent.find(name)
    text = "" if child is None or child.text is None else child.text.strip()
    if not text:
        raise fail(path, where, "nothing", f"an element <{name}> with text")
    return text


def robot_name(words: str) -> str:
    """A name that a folder can have, from any words."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", words).strip("_").lower()
    return name or "robot"


def cable_name(words: str, place: int) -> str:
    """A name that a cable can have here, from any words; C and its place where none is left."""
    if re.fullmatch(NAME, words):
        return words
    name = re.sub(r"[^A-Za-z0-9_.-]+", "_", words).strip("_.-")[:64]
    return name or f"C{place}"


def near_file(path: Path) -> Path | None:
    """The file of that path, or the one whose path differs by upper and lower case only."""
    if path.exists():
        return path
    parent = near_file(path.parent) if path.parent != path else None
    if parent is None or not parent.is_dir():
        return None
    wanted = path.name.lower()
    return next((child for child in sorted(parent.iterdir()) if child.name.lower() == wanted), None)
