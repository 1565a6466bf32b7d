"""A form for a document, made from its schema: fields with units, ranges and errors beside them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from nicegui import ui

from cdpr_drake.errors import CdprError
from cdpr_drake.schema.declarations import Setting, settings_of
from cdpr_drake.schema.yaml_files import load_yaml
from cdpr_drake.studio.panels.field_words import (
    axis_names,
    field_words,
    in_parts,
    number_text,
    typed_number,
    typed_value,
)
from cdpr_drake.studio.workbench.document import Document
from cdpr_drake.studio.workbench.yaml_edit import has, with_value

Place = tuple[str | int, ...]
"""Keys and numbers of items from the top of a document."""


@dataclass(frozen=True, kw_only=True)
class _Cell:
    """One input: where its value is, its number in an array, and what it has to say."""

    place: Place
    rule: Setting
    index: int | None
    element: Any
    problem: Any
    order: Sequence[str]


def value_at(value: Any, place: Place) -> Any:
    """What stands at a place in a typed document."""
    for key in place:
        value = value[key] if isinstance(key, int) else getattr(value, key)
    return value


class SchemaForm:
    """Fields of a document that change it when they are left, or Enter is pressed.

    What is not accepted is said beside the field, and the document is as before.
    """

    def __init__(self, document: Document[Any]) -> None:
        """For a document."""
        self._document = document
        self._cells: list[_Cell] = []

    def clear(self) -> None:
        """Forgets all fields, before they are made anew."""
        self._cells.clear()

    def refresh(self) -> None:
        """Shows the document as it is now."""
        self._cells = [cell for cell in self._cells if not cell.element.is_deleted]
        for cell in self._cells:
            shown = self._shown(cell)
            if cell.element.value != shown or cell.problem.text:
                cell.element.value = shown
                self._say(cell, "")

    def fields(self, schema: type, place: Place, names: Sequence[str] | None = None) -> None:
        """Rows of label, fields and unit into the current slot; sections are left out."""
        rules = settings_of(schema)
        with ui.element("div").classes("studio-form"):
            for name in rules if names is None else names:
                rule = rules[name]
                if not rule.section:
                    self._row(rule, (*place, name), tuple(rules))

    def _row(self, rule: Setting, place: Place, order: Sequence[str]) -> None:
        name = str(place[-1])
        axes = f" {', '.join(axis_names(rule))}" if in_parts(rule) else ""
        label = ui.label(f"{name.replace('_', ' ')}{axes}").classes("studio-label")
        label.props["title"] = rule.help()
        with ui.element("div").classes("studio-parts"):
            cells = self.inputs(rule, place, order, problem=None)
        problem = ui.label().classes("studio-field-problem").props('role="alert"')
        problem.set_visibility(False)
        for cell in cells:
            self._cells.append(_Cell(**{**cell.__dict__, "problem": problem}))
            self._listen(self._cells[-1])

    def cells(self, rule: Setting, place: Place, order: Sequence[str], problem: Any) -> None:
        """Inputs of one field into the current slot, whose problems a label shows."""
        for cell in self.inputs(rule, place, order, problem=problem):
            self._cells.append(cell)
            self._listen(cell)

    def inputs(
        self, rule: Setting, place: Place, order: Sequence[str], problem: Any
    ) -> list[_Cell]:
        """Makes the inputs of one field: one, or one for each number."""
        value = value_at(self._document.value, place)
        made = []
        for index in range(rule.shape[0] or 0) if in_parts(rule) else (None,):
            element = self._input(rule, place, index, value)
            made.append(
                _Cell(place=place, rule=rule, index=index, element=element, problem=problem,
                      order=order)
            )  # fmt: skip
        return made

    def _input(self, rule: Setting, place: Place, index: int | None, value: Any) -> Any:
        words = " ".join(str(key).replace("_", " ") for key in place)
        words += "" if index is None else f" {axis_names(rule)[index]}"
        name = _test_name(place, index)
        if rule.kind == "switch":
            element: Any = ui.switch(value=bool(value))
        elif rule.kind == "text" and rule.choices:
            options = [*(() if not rule.nullable else ("",)), *rule.choices]
            element = ui.select(options, value="" if value is None else value)
            element.props(f'dense outlined options-dense hide-bottom-space label="{words}"')
            element.classes("studio-named")  # the list's name for programs that read aloud
        else:
            shown = field_words(rule, value) if index is None else number_text(value[index])
            element = ui.input(value=shown).props("dense outlined hide-bottom-space")
            in_table = any(isinstance(key, int) for key in place[-2:])  # whose head has the unit
            if rule.unit not in ("", "-") and index in (None, 2) and not in_table:
                element.props(f'suffix="{rule.unit}"')
            if rule.nullable and rule.kind != "text":
                element.props('placeholder="not given"')
        element.props(f'aria-label="{words}"').mark(name)
        return element.classes("studio-cell" if index is not None else "studio-field")

    def _listen(self, cell: _Cell) -> None:
        if cell.rule.kind == "switch" or (cell.rule.kind == "text" and cell.rule.choices):
            cell.element.on_value_change(lambda: self.commit(cell))
            return
        cell.element.on("keydown.enter", lambda: self.commit(cell))
        cell.element.on("blur", lambda: self.commit(cell))
        for keys in ("keydown.ctrl.z", "keydown.meta.z", "keydown.ctrl.y", "keydown.meta.y"):
            cell.element.on(
                keys, lambda event: self._step_in(cell, event.args), ["key", "shiftKey"]
            )

    def _step_in(self, cell: _Cell, pressed: Mapping[str, Any]) -> None:
        """Ctrl-Z, Ctrl-Y and Ctrl-Shift-Z in a field, where nothing typed is to be taken back."""
        if cell.element.value != self._shown(cell):
            return
        again = str(pressed["key"]).lower() == "y" or pressed["shiftKey"]
        (self._document.redo if again else self._document.undo)()

    def _shown(self, cell: _Cell) -> Any:
        value = value_at(self._document.value, cell.place)
        if cell.index is not None:
            return number_text(value[cell.index])
        if cell.rule.kind == "switch":
            return bool(value)
        return field_words(cell.rule, value)

    def commit(self, cell: _Cell) -> None:
        """Puts what is typed into the document, or says why not."""
        typed = cell.element.value
        if typed == self._shown(cell):
            self._say(cell, "")
            return
        self._say(cell, self.change(lambda text: self._edited(cell, text, typed)))

    def _edited(self, cell: _Cell, text: str, typed: Any) -> str:
        place, rule = cell.place, cell.rule
        if rule.kind == "switch":
            return with_value(text, place, bool(typed), cell.order)
        if cell.index is None:
            return with_value(text, place, typed_value(rule, str(typed or "")), cell.order)
        value: Any = typed_number(str(typed or ""))
        if has(load_yaml(text), (*place, cell.index)):
            return with_value(text, (*place, cell.index), value)
        whole = [float(item) for item in value_at(self._document.value, place)]
        return with_value(
            text, place, [*whole[: cell.index], value, *whole[cell.index + 1 :]], cell.order
        )

    def change(self, edit: Callable[[str], str]) -> str:
        """Changes the document; words for what is wrong with that, empty where it is done."""
        try:
            self._document.change(edit(self._document.text))
        except CdprError as problem:
            return "\n".join(self._document.words(problem))
        except ValueError as problem:
            return " ".join(str(problem).split())[:400]
        return ""

    def _say(self, cell: _Cell, words: str) -> None:
        cell.element.props(add="error" if words else "", remove="" if words else "error")
        cell.problem.text = words
        cell.problem.set_visibility(bool(words))


def _test_name(place: Place, index: int | None) -> str:
    parts = [*place, *(() if index is None else (index,))]
    return "cell-" + "-".join(str(part) for part in parts)
