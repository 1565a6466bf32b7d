"""A text that is checked whenever it changes, with undo and redo."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from cdpr_drake.studio.calculator import Signal

T = TypeVar("T")

_State = tuple[str, T, Path]
"""Text, what it means, and its file."""

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
        """With a text that is accepted.

        Args:
            text: The text.
            path: The file that messages name.
            read: Text and path to what the text means; raises a CdprError.

        Raises:
            CdprError: The text is not accepted.
        """
        self._read = read
        self.path, self.changed = path, Signal()
        self.text, self.value = text, read(text, path)
        self._undone: list[_State[T]] = []
        self._done: list[_State[T]] = []

    def change(self, text: str, path: Path | None = None) -> None:
        """Takes another text, as one step that can be undone.

        Args:
            text: The text.
            path: Its file from now on; None: as before.

        Raises:
            CdprError: The text is not accepted; nothing has changed.
        """
        path = path or self.path
        if text == self.text and path == self.path:
            return
        value = self._read(text, path)
        self._done.append((self.text, self.value, self.path))
        del self._done[:-MOST_STEPS]
        self._undone.clear()
        self.text, self.value, self.path = text, value, path
        self.changed.emit()

    def belongs_to(self, path: Path) -> None:
        """Says that the text stands in another file from now on, and stood there before.

        Raises:
            CdprError: It is not accepted there, where files that it names are missing.
        """
        value, before = self._read(self.text, path), self.path
        for states in (self._done, self._undone):
            for k, (text, known, where) in enumerate(states):
                states[k] = (text, known, path if where == before else where)
        self.value, self.path = value, path
        self.changed.emit()

    @property
    def can_undo(self) -> bool:
        """Whether there is a change to undo."""
        return bool(self._done)

    @property
    def can_redo(self) -> bool:
        """Whether there is a change to do again."""
        return bool(self._undone)

    def undo(self) -> None:
        """Takes the last change back, if there is one."""
        self._step(self._done, self._undone)

    def redo(self) -> None:
        """Does again what was undone last, if there is something."""
        self._step(self._undone, self._done)

    def _step(self, source: list[_State[T]], target: list[_State[T]]) -> None:
        if not source:
            return
        target.append((self.text, self.value, self.path))
        self.text, self.value, self.path = source.pop()
        self.changed.emit()

    def words(self, problem: Exception, *, lines: bool = False) -> list[str]:
        """What is wrong with a text that was not accepted, without the name of the file.

        Args:
            problem: What `change` raised.
            lines: Whether the numbers of lines stay.
        """
        said, name = str(problem).split("\n"), re.escape(str(self.path))
        if lines:
            return [re.sub(rf"^{name}:(\d+): ", r"line \1: ", line) for line in said]
        return [re.sub(rf"^{name}(:\d+)?: ", "", line) for line in said]
