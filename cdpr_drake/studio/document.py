"""A text that is checked whenever it changes, with undo and redo, and edits of a YAML text.

An edit changes one value where it stands, and nothing else: comments and order stay. What comes out
is read again and compared with what was meant; where it differs, as with anchors or odd layouts,
the whole text is written anew instead.
"""

from __future__ import annotations

import asyncio
import math
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import yaml
from nicegui import Event

from cdpr_drake.schema.typed_yaml import Place
from cdpr_drake.schema.yaml_files import YamlTextError, compose_yaml, load_yaml

T = TypeVar("T")

MOST_STEPS = 200
"""Changes that can be undone."""


class Document(Generic[T]):
    """A text, what it means, and how it became so.

    Attributes:
        text: As a file has it.
        value: What the text means; never changed in place, so that whoever holds it may keep it.
        path: The file that messages name, and beside which a text finds other files.
        changed: Called after every change of text.
    """

    def __init__(self, text: str, path: Path, read: Callable[[str, Path], T]) -> None:
        """With a text that is accepted, and what reads a text of a path, or raises a CdprError."""
        self._read, self.changed = read, Event[[]]()
        self.text, self.value, self.path = text, read(text, path), path
        self._states, self._now = [(text, self.value, path)], 0
        self._editing = asyncio.Lock()

    def change(self, text: str, path: Path | None = None) -> None:
        """Takes another text, as one step that can be undone; with a path, it is of that file.

        Raises:
            CdprError: The text is not accepted; nothing has changed.
        """
        path = path or self.path
        if (text, path) != (self.text, self.path):
            self._take(text, self._read(text, path), path)

    async def edit(self, edit: Callable[[str], str]) -> None:
        """Changes the text by a function of it; another thread reads what comes out.

        Raises:
            CdprError: The text is not accepted; nothing has changed.
        """
        async with self._editing:
            before = None
            while before != (self.text, self.path):  # else it was changed meanwhile
                before = self.text, self.path
                text, path = edit(self.text), self.path
                if text == self.text:
                    return
                value = await asyncio.to_thread(self._read, text, path)
            self._take(text, value, path)

    async def settled(self) -> None:
        """Waits for edits that are being read."""
        async with self._editing:
            pass

    def _take(self, text: str, value: T, path: Path) -> None:
        self._states[self._now + 1 :] = [(text, value, path)]
        del self._states[: -MOST_STEPS - 1]
        self._go(len(self._states) - 1)

    def _go(self, step: int) -> None:
        if 0 <= step < len(self._states):
            self._now = step
            self.text, self.value, self.path = self._states[step]
            self.changed.emit()

    def belongs_to(self, path: Path) -> None:
        """Says that the text stands in another file from now on, and stood there before.

        Raises:
            CdprError: It is not accepted there, where files that it names are missing.
        """
        value, before = self._read(self.text, path), self.path
        self._states = [
            (text, known, path if where == before else where) for text, known, where in self._states
        ]
        self._states[self._now] = (self.text, value, path)
        self._go(self._now)

    @property
    def can_undo(self) -> bool:
        """Whether there is a change to undo."""
        return self._now > 0

    @property
    def can_redo(self) -> bool:
        """Whether there is a change to do again."""
        return self._now + 1 < len(self._states)

    def undo(self) -> None:
        """Takes the last change back, if there is one."""
        self._go(self._now - 1)

    def redo(self) -> None:
        """Does again what was undone last, if there is something."""
        self._go(self._now + 1)

    def words(self, problem: Exception, *, lines: bool = False) -> list[str]:
        """What is wrong with a refused text without the name of the file, perhaps with lines."""
        file = rf"^{re.escape(str(self.path))}(?::(\d+))?: "
        return [
            re.sub(file, lambda at: f"line {at[1]}: " if lines and at[1] else "", line)
            for line in str(problem).split("\n")
        ]


def with_value(text: str, place: Place, value: Any, order: Sequence[str] = ()) -> str:
    """The text with another value at a place; sections on the way that are not there are added.

    Args:
        text: YAML, a mapping at its top.
        place: Where; a key that is not there yet is added.
        value: Numbers, texts, switches, None, and lists and mappings of them.
        order: Keys of the mapping in their usual order, for one that is added.
    """
    data, last = load_yaml(text), place[-1]
    parent = value_in(data, place[:-1])
    if parent is None:
        return with_value(text, place[:-1], {last: value}, order)
    if isinstance(parent, list) and last == len(parent):
        parent.append(value)
    else:
        parent[last] = value
    return _checked(_put(text, place, flow(value), order), data)


def with_item(text: str, place: Place, value: Any) -> str:
    """The text with one more item at the end of the list at a place, made if it is not there."""
    items = value_in(load_yaml(text), place)
    return with_value(text, (*place, len(items)) if items else place, value if items else [value])


def without_item(text: str, place: Place) -> str:
    """The text without the item of a list at a place."""
    data, above, number = load_yaml(text), place[:-1], place[-1]
    del value_in(data, above)[number]
    items = _node(compose_yaml(text), above)
    if not isinstance(items, yaml.SequenceNode) or items.flow_style or len(items.value) < 2:
        return _checked(None, data)
    node = items.value[int(number)]
    start = text.rfind("\n", 0, node.start_mark.index)
    return _checked(f"{text[:start]}{text[_line_end(text, node) :]}", data)


def value_in(data: Any, place: Place) -> Any:
    """What stands at a place in plain values or settings; None: nothing."""
    for key in place:
        try:
            data = getattr(data, str(key)) if is_dataclass(data) else data[key]
        except (AttributeError, KeyError, IndexError, TypeError):
            return None
    return data


class _Flow(yaml.SafeDumper):
    """PyYAML's, with quotes around words that are no names."""

    def represent_str(self, words: str) -> yaml.ScalarNode:
        style = None if re.fullmatch("[A-Za-z][A-Za-z0-9_-]*", words) else '"'
        return self.represent_scalar("tag:yaml.org,2002:str", words, style=style)


_Flow.add_representer(str, _Flow.represent_str)


def flow(value: Any) -> str:
    """A value in one line of YAML, numbers with all their digits."""
    words: str = yaml.dump(
        value, Dumper=_Flow, default_flow_style=True, sort_keys=False, allow_unicode=True,
        width=math.inf,
    )  # fmt: skip
    return words.removesuffix("...\n").rstrip("\n")


def _checked(new: str | None, meant: Any) -> str:
    """The edited text if it means what is meant, else all of it written anew."""
    with suppress(YamlTextError):
        if new is not None and load_yaml(new) == meant:
            return new
    words: str = yaml.safe_dump(
        meant, sort_keys=False, allow_unicode=True, default_flow_style=None, width=100
    )
    return words


def _put(text: str, place: Place, words: str, order: Sequence[str]) -> str | None:
    """The text with the words of a value at a place; None: they have no place of their own."""
    root, last = compose_yaml(text), place[-1]
    node, parent = _node(root, place), _node(root, place[:-1])
    if node is not None:
        start, end = node.start_mark.index, _end(node)
        if isinstance(node, yaml.ScalarNode) and node.style in ("|", ">"):
            words += "\n"
        elif isinstance(node, yaml.CollectionNode) and not node.flow_style:
            # What stood on lines of its own now stands behind its key.
            start, words = len(text[:start].rstrip()), f" {words}"
        return f"{text[:start]}{words}{text[end:]}"
    if not isinstance(parent, yaml.CollectionNode):
        return None
    is_list = isinstance(parent, yaml.SequenceNode)
    if not is_list:
        words = f"{last}: {words}"
    if parent.flow_style:
        end = parent.end_mark.index - 1
        return f"{text[:end].rstrip()}{', ' if parent.value else ''}{words}{text[end:]}"
    margin = " " * parent.start_mark.column
    later = order[order.index(str(last)) + 1 :] if last in order else ()
    for name, _ in () if is_list else parent.value:
        if name.value in later:
            start = name.start_mark.index
            return f"{text[:start]}{words}\n{margin}{text[start:]}"
    end = _line_end(text, parent)
    return f"{text[:end]}\n{margin}{'- ' if is_list else ''}{words}{text[end:]}"


def _node(node: Any, place: Place) -> yaml.Node | None:
    for key in place:
        children: dict[Any, yaml.Node] = {}
        if isinstance(node, yaml.SequenceNode):
            children = dict(enumerate(node.value))
        elif isinstance(node, yaml.MappingNode):
            children = {name.value: child for name, child in node.value}
        node = children.get(key)
    return node


def _end(node: yaml.Node) -> int:
    """Where a node ends without the space and comments that YAML counts to it."""
    while isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        node = last[1] if isinstance(last, tuple) else last
    return int(node.end_mark.index)


def _line_end(text: str, node: yaml.Node) -> int:
    """The end of the line where a node ends, or that before, where it ends at a line's start."""
    end = text.find("\n", _end(node) - 1)
    return len(text) if end < 0 else end
