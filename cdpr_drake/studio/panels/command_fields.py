"""The form of a command: a field for each of its options, with its words and its mistakes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from nicegui import ui

from cdpr_drake.studio.folder import WorkingFolder
from cdpr_drake.studio.workbench.command_form import (
    CommandForm,
    CommandOption,
    FieldProblem,
    OptionKind,
)


@dataclass(frozen=True)
class Choices:
    """What may be chosen for an option.

    Attributes:
        names: Of the choices.
        several: Whether several may be chosen, which a comma separates.
    """

    names: Sequence[str]
    several: bool = False


@dataclass
class Filled:
    """What was filled into forms, by command and option; it outlives the page."""

    values: dict[str, dict[str, str | bool]] = field(default_factory=dict)

    def of(self, command: str) -> dict[str, str | bool]:
        """Of one command."""
        return self.values.setdefault(command, {})


class CommandFields:
    """Fields of a command in the current slot, the first ones open, the others folded."""

    def __init__(
        self,
        form: CommandForm,
        filled: Filled,
        first: Sequence[str],
        choices: Mapping[str, Choices],
        folder: WorkingFolder,
    ) -> None:
        """Places them.

        Args:
            form: Of the command.
            filled: What was filled in before, and is from now on.
            first: Keys of the options that are always shown, in this order.
            choices: Of some options, by key.
            folder: Where files are.
        """
        self.form, self._folder = form, folder
        self._values, self._choices = filled.of(form.name), choices
        self._fields: dict[str, Any] = {}
        shown = [option for key in first if (option := form.option(key)) is not None]
        with ui.element("div").classes("studio-form"):
            for option in shown:
                self._place(option)
        others = [option for option in form.options if option not in shown]
        if others:
            folded = ui.expansion("More options").classes("w-full studio-group")
            with folded.mark("more-options"), ui.element("div").classes("studio-form"):
                for option in others:
                    self._place(option)

    def arguments(self) -> list[str]:
        """Arguments of the command as they are filled in; a field says what is wrong with it.

        Raises:
            FieldProblem: A value is not accepted.
        """
        for each in self._fields.values():
            if hasattr(each, "error"):
                each.error = None
        try:
            return self.form.arguments(self._values, self._folder.path)
        except FieldProblem as problem:
            self.say(problem.key, problem.words)
            raise

    def say(self, key: str, words: str) -> bool:
        """Says beside a field what is wrong with it; False where it has no place for that."""
        found = self._fields.get(key)
        if found is None or not hasattr(found, "error"):
            return False
        found.error = words
        return True

    def _place(self, option: CommandOption) -> None:
        key, words = option.key, option.words
        ui.label(key.replace("-", " ")).classes("studio-label")
        before = self._values.get(key)
        if option.kind == OptionKind.FLAG:
            made: Any = ui.checkbox(words, value=bool(before))
        elif key in self._choices:
            made = self._choice(self._choices[key], str(before or option.usual))
            made.props(f'label="{key}"').classes("studio-named")
        else:
            made = ui.input(value=str(before or ""), placeholder=option.usual or None)
            made.props(f'dense outlined hide-bottom-space aria-label="{key}"')
            many = "; several are separated by semicolons" if option.many else ""
            made._props["hint"] = words.rstrip(".") + many
        made.classes("w-full").mark(f"{self.form.name}-{key}")
        made.on_value_change(lambda event, key=key: self._take(key, event.value))
        self._fields[key] = made

    def _choice(self, choices: Choices, usual: str) -> Any:
        chosen = [part for part in usual.split(",") if part in choices.names]
        if choices.several:
            made = ui.select(list(choices.names), value=chosen, multiple=True)
            return made.props("dense options-dense outlined use-chips")
        value = chosen[0] if chosen else None
        made = ui.select(list(choices.names), value=value, clearable=not usual)
        return made.props("dense options-dense outlined")

    def _take(self, key: str, value: Any) -> None:
        if isinstance(value, list):
            value = ",".join(value)
        self._values[key] = value if isinstance(value, bool) else str(value or "")
