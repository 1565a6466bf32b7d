"""What all readers share: text, numbers and names, with errors of one line each."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from cdpr_drake.arrays import Array
from cdpr_drake.errors import RobotFileError

MOST_BYTES = 4_194_304
"""Of a file of another tool; the largest that is known has 60 kB."""

_SHOWN = 40


def read_text(path: Path) -> str:
    """The file's text, UTF-8 or Latin-1, without a byte order mark.

    Raises:
        RobotFileError: It cannot be read, or is larger than `MOST_BYTES`.
    """
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise RobotFileError(f"{path}: found {size:,} bytes; accepted: at most {MOST_BYTES:,}")
        content = path.read_bytes()
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


def read_json(path: Path) -> Any:
    """What a JSON file holds; commas before a closing bracket are let pass.

    Raises:
        RobotFileError: The file cannot be read or does not parse; names the line.
    """
    text = read_text(path)
    # A string, or a comma that nothing but space divides from a closing bracket.
    text = re.sub(r'("(?:\\.|[^"\\])*")|,(?=\s*[\]}])', lambda found: found.group(1) or "", text)
    try:
        return json.loads(text)
    except json.JSONDecodeError as problem:
        raise RobotFileError(
            f"{path}:{problem.lineno}: does not parse as JSON: {problem.msg}"
        ) from problem
    except RecursionError as problem:
        raise RobotFileError(f"{path}: does not parse as JSON: nested too deeply") from problem


def read_yaml(path: Path) -> Any:
    """What a YAML file holds.

    Raises:
        RobotFileError: The file cannot be read or does not parse; names the line.
    """
    try:
        return yaml.safe_load(read_text(path))
    except yaml.YAMLError as problem:
        mark = getattr(problem, "problem_mark", None)
        line = f":{mark.line + 1}" if mark is not None else ""
        what = getattr(problem, "problem", None) or str(problem).splitlines()[0]
        raise RobotFileError(f"{path}{line}: does not parse as YAML: {what}") from problem
    except (ValueError, RecursionError) as problem:
        raise RobotFileError(f"{path}: does not parse as YAML: {problem}") from problem


def fail(path: Path, where: str, found: object, accepted: str) -> RobotFileError:
    """The error of a field: file, field, what was found and what is accepted."""
    words = str(found)
    words = words if words.isprintable() else repr(words)
    if len(words) > _SHOWN:
        words = words[: _SHOWN - 3] + "..."
    return RobotFileError(f"{path}: {where}: found {words or 'nothing'}; accepted: {accepted}")


def number(path: Path, where: str, value: object) -> float:
    """A finite number, from text or a number.

    Raises:
        RobotFileError: It is none, such as a placeholder.
    """
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        result = np.nan
    if isinstance(value, bool) or not np.isfinite(result):
        raise fail(path, where, value, "a finite number")
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


def near_file(path: Path) -> Path | None:
    """The file of that path, or the one whose path differs by upper and lower case only."""
    if path.exists():
        return path
    parent = near_file(path.parent) if path.parent != path else None
    if parent is None or not parent.is_dir():
        return None
    wanted = path.name.lower()
    return next((child for child in sorted(parent.iterdir()) if child.name.lower() == wanted), None)
