"""A text that is checked whenever it changes, with undo and redo."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from nicegui import Event

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
