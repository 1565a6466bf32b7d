"""A text that is checked whenever it changes, with undo and redo."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from cdpr_drake.models import Robot, parse_robot
from cdpr_drake.studio.workbench.signal import Signal

T = TypeVar("T")

MOST_STEPS = 200
"""Changes that can be undone."""


class Document(Generic[T]):
    """A text, what it means, and how it became so.

    Attributes:
        text: As a file has it.
        value: What the text means; never changed in place, so that whoever holds it may keep it.
        name: What messages call it, and a file name that fits.
        saved: The text that is in its file; empty: it has none.
        changed: Called after every change of text.
    """

    def __init__(self, text: str, name: str, read: Callable[[str, Path], T]) -> None:
        """With a text that is accepted.

        Args:
            text: The text.
            name: What messages call it.
            read: Text and the path that messages name, to what it means; raises a CdprError.

        Raises:
            CdprError: The text is not accepted.
        """
        self._read = read
        self.name, self.changed = name, Signal()
        self.text, self.value, self.saved = text, read(text, Path(name)), ""
        self._undone: list[tuple[str, T]] = []
        self._done: list[tuple[str, T]] = []

    def change(self, text: str) -> None:
        """Takes another text, as one step that can be undone.

        Raises:
            CdprError: The text is not accepted; nothing has changed.
        """
        if text == self.text:
            return
        value = self._read(text, Path(self.name))
        self._done.append((self.text, self.value))
        del self._done[:-MOST_STEPS]
        self._undone.clear()
        self.text, self.value = text, value
        self.changed.emit()

    def replace(self, text: str, name: str) -> None:
        """Takes the text of another file, whose name it has from now on; can be undone.

        Raises:
            CdprError: The text is not accepted; nothing has changed.
        """
        before, self.name = self.name, name
        try:
            self.change(text)
        except Exception:
            self.name = before
            raise

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

    def _step(self, source: list[tuple[str, T]], target: list[tuple[str, T]]) -> None:
        if not source:
            return
        target.append((self.text, self.value))
        self.text, self.value = source.pop()
        self.changed.emit()


def robot_document(text: str, name: str) -> Document[Robot]:
    """A robot file as a document.

    Args:
        text: YAML of a robot file.
        name: What messages call it.

    Raises:
        RobotFileError: The text does not describe a possible robot.
    """
    return Document(text, name, parse_robot)
