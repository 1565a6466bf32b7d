"""The sections of a document as folding groups, and lists of sections as tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from cdpr_drake.palette import nth_look
from cdpr_drake.schema.declarations import Setting, settings_of
from cdpr_drake.studio.panel import notify
from cdpr_drake.studio.panels.field_words import axis_names, in_parts, typed_value
from cdpr_drake.studio.panels.schema_form import Place, SchemaForm, value_at
from cdpr_drake.studio.workbench.document import Document
from cdpr_drake.studio.workbench.yaml_edit import with_item, with_value, without_item


class SchemaGroups:
    """All of a document: a group for its own fields, one for each section, a table for lists.

    It is built anew when sections or items come or go; else only values change.
    """

    def __init__(
        self,
        document: Document[Any],
        schema: type,
        *,
        first: tuple[str, ...] = (),
        opened: tuple[str, ...] = (),
        colored: tuple[str, ...] = (),
    ) -> None:
        """Places the groups into the current slot.

        Args:
            document: The document.
            schema: Its schema.
            first: Names of the sections that stand above the others.
            opened: Names of those that are unfolded at the start.
            colored: Names of the lists whose items have the colours of their numbers.
        """
        self._document, self._schema = document, schema
        self._form = SchemaForm(document)
        self._first, self._colored = first, colored
        self._unfolded = set(opened)
        self._layout: Any = None
        self._box = ui.element("div").classes("w-full")
        self.refresh()

    def refresh(self) -> None:
        """Shows the document as it is now."""
        layout = _layout(self._schema, self._document.value)
        if layout == self._layout:
            self._form.refresh()
            return
        self._layout = layout
        self._form.clear()
        self._box.clear()
        rules = settings_of(self._schema)
        names = [*self._first, *(name for name in rules if name not in self._first)]
        with self._box:
            for name in names:
                if rules[name].section:
                    self._group(name, rules[name])
            with self._expansion("general", "General", "Name, motion, gravity and the like."):
                self._form.fields(self._schema, ())

    def _expansion(self, key: str, title: str, words: str) -> Any:
        made = ui.expansion(title, caption=words, value=key in self._unfolded)
        made.classes("studio-group w-full").props("dense").mark(f"group-{key}")

        def fold() -> None:
            (self._unfolded.add if made.value else self._unfolded.discard)(key)

        made.on_value_change(fold)
        return made

    def _group(self, name: str, rule: Setting) -> None:
        title = name.replace("_", " ").capitalize()
        with self._expansion(name, title, rule.doc):
            if rule.kind == "sections":
                self._table((name,), rule.section)
            else:
                self._section((name,), rule, rule.section)

    def _section(self, place: Place, rule: Setting | None, bare: type) -> None:
        """Fields of a section, then its own sections; of one that is not there how to add it.

        Without a setting it is an item of a list.
        """
        if value_at(self._document.value, place) is None:
            self._add_button(place, rule, bare)
            return
        self._form.fields(bare, place)
        for name, inner in settings_of(bare).items():
            if not inner.section:
                continue
            ui.label(name.replace("_", " ")).classes("studio-subtitle").props["title"] = inner.doc
            with ui.element("div").classes("studio-inner"):
                if inner.kind == "sections":
                    self._table((*place, name), inner.section)
                else:
                    self._section((*place, name), inner, inner.section)
        if rule is not None and rule.nullable:
            what = str(place[-1]).replace("_", " ")
            self._button(
                f"Remove {what}", "delete",
                lambda: self._change(lambda text: with_value(text, place, None)),
            )  # fmt: skip

    def _table(self, place: Place, bare: type) -> None:
        """Items in rows: what each must have in columns, all else behind a button."""
        rules = settings_of(bare)
        columns = {name: rule for name, rule in rules.items() if rule.required and not rule.section}
        widths = [
            "minmax(11rem, 3fr)" if in_parts(r) else "minmax(3.4rem, 0.8fr)"
            for r in columns.values()
        ]
        items = value_at(self._document.value, place)
        is_colored = place[-1] in self._colored
        with ui.element("div").classes("studio-table") as table:
            table.style(f"grid-template-columns: 1.1rem {' '.join(widths)} 3.6rem")
            ui.label()
            for name, rule in columns.items():
                unit = f" [{rule.unit}]" if rule.unit not in ("", "-") else ""
                axes = f" {', '.join(axis_names(rule))}" if in_parts(rule) else ""
                head = ui.label(f"{name.replace('_', ' ')}{axes}{unit}").classes("studio-head")
                head.props["title"] = rule.help()
            ui.label()
            for number in range(len(items)):
                self._item((*place, number), bare, columns, is_colored)
        self._add_button(place, None, bare)

    def _item(
        self, place: Place, bare: type, columns: Mapping[str, Setting], is_colored: bool
    ) -> None:
        number = place[-1]
        assert isinstance(number, int)
        swatch = ui.element("i").classes("studio-swatch")
        if is_colored:
            swatch.style(f"background: {nth_look(number).color}")
        parts = []
        for name, rule in columns.items():
            with ui.element("div").classes("studio-parts") as part:
                parts.append((name, rule, part))
        with ui.row().classes("studio-tools"):
            what = f"{str(place[-2]).rstrip('s')} {number + 1}"
            self._icon("more_horiz", f"More of {what}", lambda: self._more(place, bare))
            self._icon(
                "delete", f"Remove {what}",
                lambda: self._change(lambda text: without_item(text, place)),
            )  # fmt: skip
        problem = ui.label().classes("studio-row-problem").props('role="alert"')
        problem.set_visibility(False)
        for name, rule, part in parts:
            with part:
                self._form.cells(rule, (*place, name), tuple(settings_of(bare)), problem)

    def _more(self, place: Place, bare: type) -> None:
        """A dialog with everything about one item."""
        title = " ".join(
            str(key + 1) if isinstance(key, int) else key.replace("_", " ") for key in place
        )
        with ui.dialog() as dialog, ui.card().classes("studio-dialog"):
            ui.label(title.capitalize()).classes("studio-subtitle")
            self._section(place, None, bare)
            ui.button("Close", on_click=dialog.close).props("flat no-caps")
        dialog.on_value_change(lambda: None if dialog.value else dialog.delete())
        dialog.open()

    def _add_button(self, place: Place, rule: Setting | None, bare: type) -> None:
        name = str(place[-1]).replace("_", " ")
        name = name.removesuffix("s") if rule is None else name
        with ui.row().classes("items-center"):
            self._button(f"Add {name}", "add", lambda: self._adding(place, bare, rule is None))
            if rule is not None:
                ui.label(rule.doc).classes("studio-soft")

    def _adding(self, place: Place, bare: type, is_item: bool) -> None:
        """A dialog for what a new section or item must have."""
        rules = _required(bare)
        with ui.dialog() as dialog, ui.card().classes("studio-dialog"):
            ui.label(f"Add {str(place[-1]).replace('_', ' ')}").classes("studio-subtitle")
            fields = {}
            for name, rule in rules.items():
                words = " ".join(name).replace("_", " ")
                fields[name] = ui.input(words).props("dense outlined").classes("w-full")
                fields[name].props(f'hint="{_plain(rule.accepts())}"').mark(f"add-{name[-1]}")
            said = ui.label().classes("studio-field-problem").props('role="alert"')

            def add() -> None:
                value: dict[str, Any] = {}
                for name, rule in rules.items():
                    inner = value
                    for key in name[:-1]:
                        inner = inner.setdefault(key, {})
                    inner[name[-1]] = typed_value(rule, str(fields[name].value or ""))
                put = with_item if is_item else with_value
                said.text = self._form.change(lambda text: put(text, place, value))
                if not said.text:
                    dialog.close()

            with ui.row():
                ui.button("Add", on_click=add).props("no-caps").mark("add")
                ui.button("Cancel", on_click=dialog.close).props("flat no-caps")
        dialog.on_value_change(lambda: None if dialog.value else dialog.delete())
        dialog.open()

    def _change(self, edit: Callable[[str], str]) -> None:
        words = self._form.change(edit)
        if words:
            notify(words)

    @staticmethod
    def _button(words: str, icon: str, action: Callable[[], None]) -> None:
        ui.button(words, icon=icon, on_click=action).props("flat dense no-caps")

    @staticmethod
    def _icon(icon: str, words: str, action: Callable[[], None]) -> None:
        made = ui.button(icon=icon, on_click=action).props("flat round dense size=sm")
        made.props(f'aria-label="{words}" title="{words}"')


def _required(schema: type, place: tuple[str, ...] = ()) -> dict[tuple[str, ...], Setting]:
    """Fields that a section must have, also in the sections that it must have."""
    found: dict[tuple[str, ...], Setting] = {}
    for name, rule in settings_of(schema).items():
        if rule.required and rule.kind == "section":
            found |= _required(rule.section, (*place, name))
        elif rule.required and rule.kind != "sections":
            found[(*place, name)] = rule
    return found


def _plain(words: str) -> str:
    return words.replace('"', "'")


def _layout(schema: type, value: Any) -> Any:
    """What a form's rows follow from: which sections are there, and how long lists are."""
    if value is None:
        return None
    found: dict[str, Any] = {}
    for name, rule in settings_of(schema).items():
        inner = getattr(value, name)
        if rule.kind == "section":
            found[name] = _layout(rule.section, inner)
        elif rule.kind == "sections":
            found[name] = [_layout(rule.section, item) for item in inner]
    return found
