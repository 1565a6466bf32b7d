"""Which options a command takes, and its arguments from what was filled in."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from cdpr_drake.errors import CdprError


class OptionKind(StrEnum):
    """What an option takes."""

    FLAG = "flag"
    INTEGER = "integer"
    NUMBER = "number"
    TEXT = "text"
    FILE = "file"


class FieldProblem(CdprError):
    """A field is not accepted.

    Attributes:
        key: The option's.
        words: What is wrong.
    """

    def __init__(self, key: str, words: str) -> None:
        """For the option of a key."""
        super().__init__(words)
        self.key, self.words = key, words


@dataclass(frozen=True)
class CommandOption:
    """One option.

    Attributes:
        name: As it is written, with its dashes.
        words: What it is, with units and ranges.
        kind: What it takes.
        many: Whether it may be repeated; the values are then separated by semicolons.
        usual: Its default, in words; empty: none.
    """

    name: str
    words: str
    kind: OptionKind
    many: bool = False
    usual: str = ""

    @property
    def key(self) -> str:
        """Its name without dashes."""
        return self.name.lstrip("-")

    def arguments(self, value: str | bool, path_of: Callable[[str], Path]) -> list[str]:
        """It with a value; nothing where that is empty or the usual one.

        Raises:
            FieldProblem: It is not accepted.
        """
        if self.kind == OptionKind.FLAG:
            return [self.name] if value else []
        words = str(value).strip()
        if not words or words == self.usual:
            return []
        parts = words.split(";") if self.many else [words]
        return [f"{self.name}={self._checked(part.strip(), path_of)}" for part in parts]

    def _checked(self, words: str, path_of: Callable[[str], Path]) -> str:
        if not words.isprintable():
            raise FieldProblem(self.key, f"{self.name}: found unprintable characters")
        if self.kind == OptionKind.FILE:
            try:
                return str(path_of(words))
            except CdprError as problem:
                raise FieldProblem(self.key, f"{self.name}: {problem}") from problem
        if self.kind in (OptionKind.INTEGER, OptionKind.NUMBER):
            whole = self.kind == OptionKind.INTEGER
            try:
                number = float(int(words)) if whole else float(words)
            except (ValueError, OverflowError):
                number = math.nan
            if not math.isfinite(number):
                wanted = "a whole number" if whole else "a number"
                raise FieldProblem(
                    self.key, f"{self.name}: found {words[:60]!r}; accepted: {wanted}"
                )
        return words


@dataclass(frozen=True)
class CommandForm:
    """What a command takes.

    Attributes:
        name: Of the command.
        words: What it does.
        options: In the order of its help.
    """

    name: str
    words: str
    options: tuple[CommandOption, ...]

    def option(self, key: str) -> CommandOption | None:
        """The option of a key; None: there is none."""
        return next((option for option in self.options if option.key == key), None)

    def arguments(
        self, values: Mapping[str, str | bool], path_of: Callable[[str], Path]
    ) -> list[str]:
        """Arguments of the command.

        Args:
            values: What was filled in, by key.
            path_of: The path of a file by its name; raises a CdprError for what may not be used.

        Raises:
            FieldProblem: A value is not accepted; the command itself may refuse more.
        """
        found: list[str] = []
        for option in self.options:
            if option.key in values:
                found += option.arguments(values[option.key], path_of)
        return found

    def allows(self, words: Sequence[str], is_inside: Callable[[str], bool]) -> bool:
        """Whether arguments are such as `arguments` makes, as far as can be seen.

        Args:
            words: The arguments.
            is_inside: Whether a file of that path may be used.
        """
        for word in words:
            name, equals, value = word.partition("=")
            option = self.option(name.removeprefix("--")) if name.startswith("--") else None
            if option is None or not word.isprintable():
                return False
            if (option.kind == OptionKind.FLAG) == bool(equals):
                return False
            if option.kind == OptionKind.FILE and not is_inside(value):
                return False
        return True

    def field_of(self, message: str) -> str:
        """Key of the option that a message of the command is about; empty: of none."""
        for name in re.findall(r"--[a-z][a-z-]*", message):
            if self.option(name.lstrip("-")) is not None:
                return str(name.lstrip("-"))
        return ""
