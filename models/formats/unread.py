"""What of a file a reader used, and what is left: named as not kept.

A reader wraps the parsed document (`watched`) and reads it as before. Each key, attribute and text
that it asks for is recorded; `not_kept` names all others. Where another program reads the file, as
Drake or MuJoCo, the reader says what that took (`mark`).
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterator
from typing import Any

TEXT = "text()"
"""Stands for the text of an element among its attributes."""

MOST_NAMED = 40
"""Parts of a file that a remark names; of more it says how many."""

MOST_OWNERS = 4
"""Elements whose parts they are that a remark names for each."""


class WatchedElement(ET.Element):
    """An element of XML that records which attributes and text were asked for."""

    def __init__(self, tag: str, attributes: dict[str, str]) -> None:
        super().__init__(tag, attributes)
        self.used: set[str] = set()

    @property
    def text(self) -> str | None:  # type: ignore[override]
        """Its text, which counts as used from then on."""
        self.used.add(TEXT)
        return self.bare_text()

    @text.setter
    def text(self, value: str | None) -> None:
        ET.Element.text.__set__(self, value)  # type: ignore[attr-defined]

    def bare_text(self) -> str | None:
        """Its text, not counted as used."""
        return ET.Element.text.__get__(self)  # type: ignore[attr-defined, no-any-return]

    def get(self, key: str, default: Any = None) -> Any:
        """An attribute, which counts as used from then on."""
        self.used.add(key)
        return super().get(key, default)

    def findtext(self, path: str, default: Any = None, namespaces: Any = None) -> Any:
        """The text of the first element of a path, which counts as used."""
        found = self.find(path, namespaces)
        return default if found is None else found.text or ""

    def parts(self) -> set[str]:
        """Its attributes, and `TEXT` if it has some; of an empty element `TEXT` as well."""
        has_text = bool((self.bare_text() or "").strip())
        empty = not self.attrib and not len(self)
        return {*self.attrib, *({TEXT} if has_text or empty else ())}


class WatchedMapping(dict[Any, Any]):
    """A mapping of a document that records which keys were asked for."""

    def __init__(self, content: dict[Any, Any]) -> None:
        super().__init__({key: watched(value) for key, value in content.items()})
        self.used: set[Any] = set()

    def __getitem__(self, key: Any) -> Any:
        """A value; its key counts as used from then on."""
        self.used.add(key)
        return super().__getitem__(key)

    def get(self, key: Any, default: Any = None) -> Any:
        """A value or a default; its key counts as used from then on."""
        self.used.add(key)
        return super().get(key, default)


def watched(document: Any) -> Any:
    """A copy of a parsed document, XML, JSON or YAML, that records what is read of it."""
    if isinstance(document, ET.Element):
        copy = WatchedElement(document.tag, dict(document.attrib))
        copy.text = document.text
        copy.extend([watched(child) for child in document])
        return copy
    if isinstance(document, dict):
        return WatchedMapping(document)
    if isinstance(document, list):
        return [watched(item) for item in document]
    return document


def mark(element: ET.Element, *attributes: str) -> None:
    """Counts attributes of one element as used, `TEXT` for its text; all of them without names."""
    assert isinstance(element, WatchedElement)
    element.used.update(attributes or element.parts())


def mark_below(part: Any) -> None:
    """Counts a part of a watched document and all below it as used."""
    if isinstance(part, ET.Element):
        for item in part.iter():
            if isinstance(item.tag, str):
                mark(item)
    if isinstance(part, WatchedMapping):
        part.used.update(part)
        for value in part.values():
            mark_below(value)
    if isinstance(part, list):
        for value in part:
            mark_below(value)


def not_kept(document: Any, presentation: Collection[str] = ()) -> list[str]:
    """A remark that names what was not used of a watched document; empty if all was.

    Args:
        document: What `watched` gave.
        presentation: Tags, keys and `TAG@ATTRIBUTE` that say only how things look or are called.
    """
    if isinstance(document, WatchedElement):
        left = _left_of_element(document, "", "", presentation)
    else:
        left = _left_of_mapping(document, "", presentation)
    found: dict[str, list[str]] = {}
    for where, name in left:
        found.setdefault(where, []).append(name)
    words = [where + _of(names) for where, names in found.items()]
    if len(words) > MOST_NAMED:
        words = [*words[:MOST_NAMED], f"{len(words) - MOST_NAMED} more"]
    return [f"Not kept: {', '.join(words)}."] if words else []


def _of(names: list[str]) -> str:
    """Whose parts they are, or how many."""
    some = [name for name in dict.fromkeys(names) if name]
    if not some:
        return "" if len(names) == 1 else f" ({len(names)} times)"
    more = [] if len(some) <= MOST_OWNERS else [f"{len(some) - MOST_OWNERS} more"]
    return f" of {', '.join([*some[:MOST_OWNERS], *more])}"


def _hidden(name: str, attribute: str, presentation: Collection[str]) -> bool:
    return f"{name}@{attribute}" in presentation or f"@{attribute}" in presentation


def _left_of_element(
    element: WatchedElement, path: str, owner: str, presentation: Collection[str]
) -> Iterator[tuple[str, str]]:
    if not isinstance(element.tag, str):  # of comments it is a function
        return
    tag = element.tag.rpartition("}")[2]
    if tag in presentation:
        return
    here = f"{path}/{tag}" if path else tag
    owner = dict(element.attrib).get("name") or owner
    if not any(item.used for item in element.iter() if isinstance(item, WatchedElement)):
        yield here, owner
        return
    for part in sorted(element.parts() - element.used):
        if not _hidden(tag, part.rpartition("}")[2], presentation):
            yield (here if part == TEXT else f"{here}@{part}"), owner
    for child in element:
        assert isinstance(child, WatchedElement)
        yield from _left_of_element(child, here, owner, presentation)


def _left_of_mapping(
    content: Any, path: str, presentation: Collection[str]
) -> Iterator[tuple[str, str]]:
    if isinstance(content, list):
        for item in content:
            yield from _left_of_mapping(item, f"{path}[]", presentation)
    if not isinstance(content, WatchedMapping):
        return
    for key, value in content.items():
        here = f"{path}.{key}" if path else f"{key}"
        if here in presentation:
            continue
        if key not in content.used:
            yield here, ""
        else:
            yield from _left_of_mapping(value, here, presentation)
