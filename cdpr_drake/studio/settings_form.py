"""A form of any settings: fields with units, choices and reasons, sections, and tables of items.

What is typed becomes what a file would have; the checks of files judge it, in their words.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Any

import numpy as np
from nicegui import ui

from cdpr_drake.errors import CdprError, DataFileError
from cdpr_drake.palette import nth_look
from cdpr_drake.schema.declarations import Setting, settings_of
from cdpr_drake.schema.typed_yaml import Place, plain_value
from cdpr_drake.schema.yaml_files import load_yaml
from cdpr_drake.studio.document import Document, flow, value_in, with_item, with_value, without_item
from cdpr_drake.studio.panel import message, notify, show_errors

Edit = Callable[[str], str]
Action = Callable[[], Awaitable[object]]

LONGEST_LIST = 40
"""Choices that are offered as a list; more are typed."""


def field_words(rule: Setting, value: Any) -> Any:
    """A value of settings as it stands in a field: words, or True and False of a switch."""
    if rule.kind == "switch":
        return bool(value)
    if value is None or isinstance(value, str):
        return value or ""
    if rule.kind in ("number", "whole"):
        return str(value + 0).removesuffix(".0")  # the sum is no -0
    if rule.kind == "array" and np.ndim(value) == 1:
        return ", ".join(field_words(replace(rule, type=float), number) for number in value)
    return ", ".join(value) if rule.kind == "texts" else flow(plain_value(value))


def typed_value(rule: Setting, typed: Any) -> Any:
    """What a file gets of what is typed in a field; None where there is nothing and may be none.

    What is no number stays the words that it is, so that the checks say what they accept.

    Raises:
        YamlTextError: A list or mapping is no YAML.
    """
    if rule.kind == "switch":
        return bool(typed)
    words = str(typed or "").strip()
    if not words and rule.nullable:
        return None
    if rule.kind in ("number", "whole"):
        return _typed_number(words)
    if rule.kind == "text":
        return words
    if words.startswith(("[", "{")) or rule.section:
        return load_yaml(words)
    if rule.kind == "texts":
        return [word.strip() for word in words.split(",") if word.strip()]
    return [_typed_number(word) for word in words.replace(",", " ").split()]


def _typed_number(words: str) -> float | int | str:
    for kind in (int, float):
        with suppress(ValueError):
            number = kind(words)
            return number if np.isfinite(number) else words
    return words


@dataclass(frozen=True)
class _Cell:
    """An input of the value at a place, with a label for why it is not accepted."""

    place: Place
    rule: Setting
    element: Any
    problem: Any


class SettingsForm:
    """All fields of a document: folding groups of its sections and of its own, tables of lists.

    A field changes the document when it is left, or Enter is pressed. What is not accepted stays in
    its field with the reason, and is tried again together with the next edit; Escape drops it. The
    form is built anew when sections or items come or go; else only values change.
    """

    def __init__(
        self, document: Document[Any], *, mark: str = "cell", common: Sequence[Place] = (),
        without: Sequence[str] = (), first: Sequence[str] = (), opened: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Places the form into the current slot; marks of its inputs begin with `mark`.

        `common` are the places of fields above all groups, `without` names of fields at the top
        that are not shown, `first` of the sections above the others, and `opened` of groups that
        are unfolded at the start; the others are filled when they are unfolded.
        """
        self._document, self._schema, self._mark = document, type(document.value), mark
        self._common, self._without, self._first = common, without, first
        self._unfolded = set(opened)
        self._cells: list[_Cell] = []
        self._pending: dict[Place, tuple[_Cell, Any, str, Any]] = {}  # typed, why not, for what
        self._layout, self._path = None, document.path
        self._box = ui.element("div").classes("w-full")
        self.refresh()
        document.changed.subscribe(self.refresh)

    def refresh(self) -> None:
        """Shows the document as it is now."""
        if self._document.path != self._path:  # another file was opened
            self._path = self._document.path
            self._pending.clear()
        layout = _layout(self._document.value)
        if layout != self._layout:
            self._layout = layout
            self._box.clear()
            with self._box:
                self._build()
        self._cells = [cell for cell in self._cells if not cell.element.is_deleted]
        for cell in self._cells:
            self._show(cell)

    def _build(self) -> None:
        with ui.element("div").classes("studio-form"):
            for place in self._common:
                if hasattr(self._value(place[:-1]), str(place[-1])):
                    rule = self._rules(place[:-1])[str(place[-1])]
                    self._row(place, rule, " ".join(map(str, place)))
        rules = settings_of(self._schema)
        for name in dict.fromkeys([*self._first, *rules]):
            if rules[name].section:
                self._group(name, rules[name].doc, partial(self._inner, (name,), rules[name]))
        self._group("general", "Fields of no section.", partial(self._fields, ()))

    def _group(self, name: str, doc: str, fill: Callable[[], None]) -> None:
        fold = ui.expansion(_words(name).capitalize(), caption=doc, value=name in self._unfolded)
        fold.classes("studio-group w-full").props("dense").mark(f"{self._mark}-group-{name}")

        def turn() -> None:
            (self._unfolded.add if fold.value else self._unfolded.discard)(name)
            if fold.value and not fold.default_slot.children:
                with fold:
                    fill()

        fold.on_value_change(turn)
        turn()

    def _value(self, place: Place) -> Any:
        return value_in(self._document.value, place)

    def _rules(self, place: Place) -> dict[str, Setting]:
        """The settings of the section or item at a place, or of the items of a list there."""
        schema = self._schema
        for key in place:
            schema = schema if isinstance(key, int) else settings_of(schema)[key].section
        return settings_of(schema)

    def _inner(self, place: Place, rule: Setting) -> None:
        """A section with its own, or a table; of what is not there how to add it."""
        value, name = self._value(place), _words(rule.name)
        if rule.kind == "sections":
            self._table(place, len(value))
            name = name.removesuffix("s")
        elif value is None:
            ui.label(rule.doc if place[1:] else "").classes("studio-soft")  # a group has said it
        else:
            self._section(place)
            if rule.nullable:
                edit = partial(with_value, place=place, value=None)
                tool(f"Remove {name}", "delete", partial(self._change, edit))
            return
        tool(f"Add {name}", "add", partial(self._add, place, f"Add {name}"))

    def _section(self, place: Place) -> None:
        """The fields of a section, or of an item of a list, then its own sections."""
        self._fields(place)
        for name, rule in self._rules(place).items():
            if rule.section:
                ui.label(_words(name)).classes("studio-subtitle").props["title"] = rule.doc
                with ui.element("div").classes("studio-inner"):
                    self._inner((*place, name), rule)

    def _fields(self, place: Place) -> None:
        """Rows of label, inputs and unit; sections are left out."""
        with ui.element("div").classes("studio-form"):
            for name, rule in self._rules(place).items():
                above = (*place, name) in self._common or (not place and name in self._without)
                if not rule.section and not above:
                    self._row((*place, name), rule, name)

    def _row(self, place: Place, rule: Setting, words: str) -> None:
        _title("studio-label", rule, _words(words))
        self._field(place, rule, ui.element("div").classes("studio-parts"))

    def _field(self, place: Place, rule: Setting, box: Any) -> None:
        """Makes the inputs of one field in a box, one or one for each number, and their labels."""
        parts = [((*place, k), replace(rule, type=float), axis) for k, axis in _axes(rule)]
        for at, part, name in parts or [(place, rule, rule.name)]:
            with box:
                element = self._input(at, part, " ".join(map(_words, (*at[:-1], name))))
            problem = ui.label().classes("studio-field-problem").props('role="alert"')
            cell = _Cell(at, part, element, problem)
            self._cells.append(cell)
            self._show(cell)
            commit = partial(self._commit, cell)
            if rule.kind == "switch" or _is_choice(rule):
                element.on_value_change(commit)
                continue
            element.on("keydown.enter", commit).on("blur", commit)
            element.on("keydown.escape", partial(self._drop, cell))
            for keys in ("ctrl.z", "meta.z", "ctrl.y", "meta.y"):
                element.on(f"keydown.{keys}", partial(self._step, cell), ["key", "shiftKey"])

    def _input(self, place: Place, rule: Setting, words: str) -> Any:
        last, is_part = place[-1], isinstance(place[-1], int)
        if rule.kind == "switch":
            element: Any = ui.switch()
        elif _is_choice(rule):
            element = ui.select([*([""] if rule.nullable else []), *rule.choices])
            element.props(f'options-dense hide-bottom-space label="{words}"')
            element.classes("studio-named")  # the list's name for programs that read aloud
        else:
            element = ui.input().props("hide-bottom-space")
            in_table = any(isinstance(key, int) for key in place[-2 - is_part : -1])
            if rule.unit not in ("", "-") and last not in (0, 1) and not in_table:
                element.props["suffix"] = rule.unit
            if rule.nullable and rule.kind != "text":
                element.props["placeholder"] = "not given"
        element.props(f'aria-label="{words}"').mark("-".join(map(str, (self._mark, *place))))
        return element.classes("studio-cell" if is_part else "studio-field")

    def _drop(self, cell: _Cell) -> None:
        self._pending.pop(cell.place, None)
        self._show(cell)

    def _step(self, cell: _Cell, event: Any) -> None:
        """Ctrl-Z, Ctrl-Y and Ctrl-Shift-Z in a field, where nothing typed is to be taken back."""
        if cell.element.value == self._shown(cell):
            again = str(event.args["key"]).lower() == "y" or event.args["shiftKey"]
            (self._document.redo if again else self._document.undo)()

    def _shown(self, cell: _Cell) -> Any:
        return field_words(cell.rule, self._value(cell.place))

    def _show(self, cell: _Cell) -> None:
        shown = self._shown(cell)
        _, typed, words, before = self._pending.get(cell.place, (cell, shown, "", shown))
        if shown != before:  # somebody has changed that
            del self._pending[cell.place]
            typed, words = shown, ""
        cell.element.value = typed
        cell.element.props(**{"add" if words else "remove": "error"})
        cell.problem.text = words
        cell.problem.set_visibility(bool(words))

    async def _commit(self, cell: _Cell) -> None:
        """Puts what is typed in a field into the document, or says beside it why not."""
        typed = cell.element.value
        self._pending.pop(cell.place, None)
        if typed != self._shown(cell):
            words = await self.change(partial(self._typed, cell, typed))
            if words:
                self._pending[cell.place] = cell, typed, words, self._shown(cell)
        self._show(cell)

    def _typed(self, cell: _Cell, typed: Any, text: str) -> str:
        """The text with what was typed in a field."""
        field = cell.place[:-1] if isinstance(cell.place[-1], int) else cell.place
        order = list(self._rules(field[:-1]))
        if field != cell.place and value_in(load_yaml(text), field) is None:  # all is the default
            text = with_value(text, field, plain_value(self._value(field)), order)
        return with_value(text, cell.place, typed_value(cell.rule, typed), order)

    async def change(self, edit: Edit) -> str:
        """Changes the document together with all that is pending, else alone.

        Returns:
            Words for why not; empty: it is changed.
        """

        def together(text: str) -> str:
            for cell, typed, *_ in others.values():
                text = self._typed(cell, typed, text)
            return edit(text)

        pending, words = dict(self._pending), ""
        for others in [pending, {}] if pending else [{}]:
            try:
                await self._document.edit(together)
            except (CdprError, OSError, ValueError) as problem:
                words = "\n".join(self._document.words(CdprError(message(problem))))
                continue
            for place in others:
                self._pending.pop(place, None)
            self.refresh()
            return ""
        return words

    async def settle(self) -> list[str]:
        """Tries once more what is pending; returns the keys of the fields that stay refused."""
        await self.change(lambda text: text)
        return [".".join(map(str, place)) for place in self._pending]

    async def _change(self, edit: Edit) -> None:
        if words := await self.change(edit):
            notify(words)

    def _table(self, place: Place, length: int) -> None:
        """Items in rows: what each must have in columns, all else behind a button."""
        rules = self._rules(place).values()
        columns = [rule for rule in rules if rule.required and not rule.section]
        widths = ("minmax(11rem, 3fr)" if _axes(rule) else "minmax(3.4rem, 0.8fr)"
                  for rule in columns)  # fmt: skip
        with ui.element("div").classes("studio-table") as table:
            table.style(f"grid-template-columns: 1.1rem {' '.join(widths)} 5.2rem")
            ui.label()
            for rule in columns:
                unit = f" [{rule.unit}]" if rule.unit not in ("", "-") else ""
                _title("studio-head", rule, _words(rule.name), unit)
            ui.label()
            for number in range(length):
                self._item((*place, number), columns)

    def _item(self, place: Place, columns: Sequence[Setting]) -> None:
        *_, name, number = place
        swatch = ui.element("i").classes("studio-swatch")
        if name == "cables":
            swatch.style(f"background: {nth_look(int(number)).color}")
        boxes = [ui.element("div").classes("studio-parts") for _ in columns]
        what, copy = f"{_words(name).rstrip('s')} {int(number) + 1}", partial(_with_copy, place)
        with ui.row().classes("studio-tools"):
            tool(f"More of {what}", "more_horiz", partial(self._more, place, what), bare=True)
            tool(f"Duplicate {what}", "content_copy", partial(self._change, copy), bare=True)
            tool(f"Remove {what}", "delete", partial(self._remove, place), bare=True)
        for rule, box in zip(columns, boxes, strict=True):
            self._field((*place, rule.name), rule, box)

    def _more(self, place: Place, what: str) -> None:
        with dialog(what.capitalize()):
            self._section(place)

    async def _remove(self, place: Place) -> None:
        for at in [at for at in self._pending if at[: len(place) - 1] == place[:-1]]:
            del self._pending[at]  # numbers mean other items then
        await self._change(partial(without_item, place=place))

    def _add(self, place: Place, title: str) -> None:
        """A dialog for what a new section or item must have."""

        async def add() -> None:
            value: dict[str, Any] = {}
            for (*above, name), (rule, field) in fields.items():
                inner = reduce(lambda section, key: section.setdefault(key, {}), above, value)
                inner[name] = typed_value(rule, field.value)
            put = with_value if self._value(place) is None else with_item
            if words := await self.change(lambda text: put(text, place, value)):
                raise CdprError(words)

        with dialog(title, "Add", add):
            fields = {
                at: (rule, ui.input(_words(" ".join(at))).mark(f"add-{at[-1]}"))
                for at, rule in _required(self._rules(place))
            }
            for rule, field in fields.values():
                hint = rule.accepts()
                if rule.kind == "sections":  # what an item must have, as YAML
                    keys = (f"{at[0]}: ..." for at, _ in _required(settings_of(rule.section)))
                    hint += ", such as [{" + ", ".join(dict.fromkeys(keys)) + "}]"
                field.classes("w-full").props["hint"] = hint


def _with_copy(place: Place, text: str) -> str:
    """The text with an item like another one, by a name of its own, at the end of its list."""
    items = value_in(load_yaml(text), place[:-1])
    item = dict(items[place[-1]])
    if "name" in item:
        item["name"] = f"{item['name']}_{len(items) + 1}"
    return with_item(text, place[:-1], item)


def _required(rules: dict[str, Setting], above: tuple[str, ...] = ()) -> Iterator[Any]:
    """Places and rules of what must be there, also in the sections that must be there."""
    for name, rule in rules.items():
        if rule.required and rule.kind == "section":
            yield from _required(settings_of(rule.section), (*above, name))
        elif rule.required:
            yield (*above, name), rule


def _layout(value: Any) -> Any:
    """What a form's rows follow from: which sections are there, and how long lists are."""
    if isinstance(value, list):
        return [_layout(item) for item in value]
    if value is None:
        return None
    rules = settings_of(type(value)).items()
    return {name: _layout(getattr(value, name)) for name, rule in rules if rule.section}


def _axes(rule: Setting) -> list[tuple[int, str]]:
    """Numbers and names of the fields of a row, along axes or of angles; none: it is one field."""
    if rule.kind != "array" or rule.shape != (3,) or rule.nullable:
        return []
    names = ("phi", "theta", "psi") if rule.unit in ("deg", "rad") else ("x", "y", "z")
    return list(enumerate(names))


def _title(kind: str, rule: Setting, words: str, unit: str = "") -> None:
    axes = ", ".join(name for _, name in _axes(rule))
    label = ui.label(f"{words} {axes}".strip() + unit).classes(kind)
    label.props["title"] = rule.help()


def _is_choice(rule: Setting) -> bool:
    return rule.kind == "text" and 0 < len(rule.choices) <= LONGEST_LIST


def _words(key: str | int) -> str:
    return str(key).replace("_", " ")


@contextmanager
def dialog(
    title: str, words: str = "", action: Action | None = None
) -> Iterator[Callable[[Action], Awaitable[bool]]]:
    """A dialog that is gone for good when it is closed, with a button for an action.

    It gives a function that does an action and closes the dialog, or says in it why not.
    """

    async def attempt(action: Action) -> bool:
        said.text = ""
        with show_errors():
            try:
                await action()
                element.close()
            except (CdprError, OSError) as problem:
                said.text = message(problem)
        return element.value is False

    with ui.dialog() as element, ui.card().classes("studio-dialog"):
        ui.label(title).classes("studio-subtitle")
        said = ui.label().classes("studio-field-problem").props('role="alert"')
        yield attempt
        with ui.row():
            if action is not None:
                ui.button(words, on_click=partial(attempt, action)).props("no-caps").mark("do")
            ui.button("Close", on_click=element.close).props("flat no-caps")
    element.on_value_change(lambda: None if element.value else element.delete())
    element.open()


def document_buttons(document: Document[Any], title: str, mark: str = "") -> None:
    """Places buttons that undo, redo and edit the text; their marks begin with `mark`."""
    undo = tool("Undo, Ctrl-Z", "undo", document.undo, bare=True).mark(f"{mark}undo")
    redo = tool("Redo, Ctrl-Y", "redo", document.redo, bare=True).mark(f"{mark}redo")

    def refresh() -> None:
        undo.set_enabled(document.can_undo)
        redo.set_enabled(document.can_redo)

    def show() -> None:
        async def apply() -> None:
            try:
                await document.edit(lambda _: str(text.value or ""))
            except CdprError as problem:
                raise DataFileError(*document.words(problem, lines=True)) from problem

        with dialog(title, "Apply", apply):
            text = ui.codemirror(document.text, language="YAML", line_wrapping=True)
            text.classes("w-full").style("height: 60vh").mark("whole-text")

    tool("As text", "notes", show).mark(f"{mark}as-text")
    refresh()
    document.changed.subscribe(refresh)


def tool(words: str, icon: str, action: Callable[[], object], *, bare: bool = False) -> ui.button:
    """Places a button, or its icon alone, whose words are told to who cannot see it."""
    made = ui.button("" if bare else words, icon=icon, on_click=action).props("flat dense no-caps")
    return made.props(f'round size=sm aria-label="{words}" title="{words}"') if bare else made
