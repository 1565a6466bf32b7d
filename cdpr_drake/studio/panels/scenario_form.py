"""A scenario's fields in the page: from its schema, with units, and errors beside the field."""

from __future__ import annotations

from typing import Any

from nicegui import run, ui

from cdpr_drake.errors import CdprError, DataFileError
from cdpr_drake.studio.panel import message
from cdpr_drake.studio.workbench.scenario_draft import (
    COMMON,
    ROBOT,
    FormField,
    FormSection,
    ScenarioDraft,
)

NULL = "null"
LONGEST_LIST = 40
"""Choices that are offered as a list; more are typed."""


class ScenarioForm:
    """Fields of one draft. Common ones are open; sections are filled when they are unfolded."""

    def __init__(self, draft: ScenarioDraft) -> None:
        """Places the form into the current slot."""
        self._draft = draft
        self._inputs: dict[str, Any] = {}
        self._errors: dict[str, str] = {}
        common = [field for key in COMMON if (field := draft.field(key)) is not None]
        self._problem = ui.label().classes("studio-problem").mark("scenario-problem")
        self._problem.visible = False
        with ui.element("div").classes("cdpr-fields"):
            for field in common:
                self._place(field)
        rest = FormSection("", "", draft.form.fields, ())
        placed = {ROBOT, *(field.key for field in common)}
        self._fold("Scenario", rest, placed)
        for section in draft.form.sections:
            self._fold(section.key, section, placed)

    def _fold(self, title: str, section: FormSection, placed: set[str]) -> None:
        fields = [field for field in section.all_fields() if field.key not in placed]
        if not fields:
            return
        words = title if not section.doc else f"{title}: {section.doc}"
        with ui.expansion(words).classes("cdpr-fold").props("dense") as fold:
            body = ui.element("div").classes("cdpr-fields")

        def fill() -> None:
            if fold.value and not body.default_slot.children:
                with body:
                    for field in fields:
                        self._place(field)
                self._show_errors()

        fold.on_value_change(fill)
        if any(field.key in self._draft.changes for field in fields):
            fold.value = True

    def _place(self, field: FormField) -> None:
        """One field, with what it has, or was given before."""
        rule, text = field.rule, self._draft.changes.get(field.key, field.text)
        label = field.key
        choices = [str(choice) for choice in rule.choices]
        if rule.kind == "switch":
            made: Any = ui.select(["true", "false"], value=text, label=label)
        elif rule.kind == "text" and choices and len(choices) <= LONGEST_LIST:
            if rule.nullable:
                choices.append(NULL)
            made = ui.select(choices, value=text if text in choices else None, label=label)
        else:
            made = ui.input(label, value=text).props("debounce=400")
            if rule.unit:
                made.props["suffix"] = rule.unit
        made.props("dense outlined hide-bottom-space").classes("cdpr-field")
        made.props["hint"] = rule.doc
        made.mark(f"field-{field.key}")
        made.props["title"] = f"Accepted: {rule.accepts()}"
        self._inputs[field.key] = made

        async def changed() -> None:
            await self._change(field.key, str(made.value if made.value is not None else ""))

        made.on_value_change(changed)

    async def _change(self, key: str, text: str) -> None:
        self._draft.change(key, text)
        await self.check()

    async def check(self) -> bool:
        """Whether the draft is accepted; shows beside the fields what is not."""
        draft = self._draft
        try:
            await run.io_bound(draft.check)
        except DataFileError as problem:
            self._errors, rest = draft.problems(problem)
            self._say("\n".join(rest))
        except (CdprError, OSError) as problem:
            self._errors = {}
            self._say(message(problem))
        else:
            self._errors = {}
            self._say("")
        self._show_errors()
        return not self._errors and not self._problem.visible

    def _say(self, words: str) -> None:
        self._problem.text = words
        self._problem.visible = bool(words)

    def _show_errors(self) -> None:
        hidden = []
        for key, words in self._errors.items():
            if key not in self._inputs:
                hidden.append(f"{key}: {words}")
        if hidden:
            self._say("\n".join(hidden))
        for key, made in self._inputs.items():
            wrong = self._errors.get(key, "")
            made.props["error"] = bool(wrong)
            made.props["error-message"] = wrong
            made.update()
