"""A scenario that is changed and run: its text as a document, what is run of it, and its form."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from nicegui import run, ui

import cdpr_drake
from cdpr_drake.analyses.runs.steering import UNTOUCHED, check_steered
from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.schema.declarations import settings_of
from cdpr_drake.schema.input_files import input_text
from cdpr_drake.schema.typed_yaml import plain_value
from cdpr_drake.schema.yaml_files import YamlTextError, load_yaml
from cdpr_drake.studio.document import Document, flow
from cdpr_drake.studio.files import is_within
from cdpr_drake.studio.panel import message
from cdpr_drake.studio.settings_form import SettingsForm, document_buttons
from cdpr_drake.systems.diagrams.load import load_scenario, parse_scenario
from cdpr_drake.systems.scenarios.files import check_moves_robot, scenario_file

COMMON = (
    "duration", "seed", "camera.kind", "controller.scheme", "controller.lambda_0",
    "controller.lambda_infinity", "estimator.kind", "distribution.method", "controller.stiffness",
    "controller.damping", "integration.engine", "log_rate",
)  # fmt: skip
"""Fields that most people change, those of them that a scenario has."""

FIXED = ("kind", "name", "title", "source", "robot")
"""Fields that a form does not have; a run is of the robot that is open."""


class ScenarioDraft:
    """A scenario by name or by path, and what is changed of it.

    Attributes:
        name: Name of one of the package, or absolute path of a file in the working folder.
        document: Its text with the changes.
        own_robot: The robot of the file, by its name or the path of its file.
        robot: The robot that is run, likewise.
    """

    def __init__(self, name: str, folder: Path) -> None:
        """Reads it; raises CdprError if it is refused, or names files outside of the folder."""
        check_moves_robot(name, "the studio")
        path = scenario_file(name).absolute()
        package = Path(cdpr_drake.__file__).resolve().parent
        shipped = [package, *(package.parent / of_it for of_it in ("models", "systems"))]
        self.name, self._folders = name, (folder.resolve(), *shipped)
        self.own_robot = self.robot = ""
        text = input_text(path)
        self._own = dict(_texts(load_yaml(text)))
        self.document: Document[Any] = Document(text, path, self._read)
        self._file = self.document.value
        self.own_robot = self.robot = str(self._file.robot)

    def _read(self, text: str, path: Path) -> Any:
        """The scenario of a text with the robot that is run; files elsewhere are not read."""
        with suppress(YamlTextError):  # the parser says what is wrong
            for key, words in _texts(load_yaml(text)):
                places = (self._folders[0] / words, path.parent / words)
                if key in ("kind", "robot") and words != self._own.get(key):
                    accepted = "that of the file; the robot that is open is run"
                elif not all(is_within(place, *self._folders) for place in places):
                    accepted = "a file in the working folder"
                else:
                    continue
                raise ScenarioError(f"{path}: {key}: found {words[:80]}; accepted: {accepted}")
        return parse_scenario(text, path, self._robot_setting())

    def _robot_setting(self) -> tuple[str, ...]:
        return () if self.robot == self.own_robot else (f"robot={flow(self.robot)}",)

    def settings(self) -> tuple[str, ...]:
        """What --set is given."""
        made = _differences(self._file, self.document.value)
        return (*(item for item in made if not item.startswith("robot=")), *self._robot_setting())

    def by_hand(self) -> tuple[str, ...]:
        """What --set is given besides, so that cables can be broken and the platform pushed.

        Of the sections that this takes, those that the scenario has not and accepts.
        """
        made: list[str] = []
        for key, least in UNTOUCHED.values():
            if getattr(self.document.value, key, "") is None:
                with suppress(CdprError):
                    load_scenario(self.name, (*self.settings(), *made, f"{key}={least}"))
                    made.append(f"{key}={least}")
        return tuple(made)

    def check(self) -> Any:
        """The scenario as it would be run; raises CdprError if it is not accepted."""
        scenario = load_scenario(self.name, self.settings())
        check_steered(scenario)
        return scenario


def _differences(before: Any, now: Any, above: str = "") -> Iterator[str]:
    """Items key=value by which settings differ, as --set takes them: lists whole, null for none."""
    for name, rule in settings_of(type(before)).items():
        old, new, key = getattr(before, name), getattr(now, name), f"{above}{name}"
        if rule.kind == "section" and old is not None and new is not None:
            yield from _differences(old, new, f"{key}.")
        elif plain_value(old) != plain_value(new):
            yield f"{key}={flow(plain_value(new))}"


def _texts(value: Any, key: str = "") -> Iterator[tuple[str, str]]:
    """Words in plain values, with their keys."""
    if isinstance(value, str):
        yield key, value
    inside = dict(enumerate(value)) if isinstance(value, list) else value
    if isinstance(inside, dict):
        for name, inner in inside.items():
            yield from _texts(inner, f"{key}.{name}".removeprefix("."))


class ScenarioForm:
    """The fields of a draft, and buttons to undo and to edit the text."""

    def __init__(self, draft: ScenarioDraft) -> None:
        """Places the form into the current slot."""
        self._draft = draft
        with ui.row().classes("studio-bar"):
            document_buttons(draft.document, "The scenario", "scenario-")
        self._problem = ui.label().classes("studio-problem").mark("scenario-problem")
        self._problem.bind_visibility_from(self._problem, "text", bool)
        changed = {item.partition("=")[0].partition(".")[0] for item in draft.settings()}
        self._form = SettingsForm(
            draft.document, mark="field", common=[tuple(key.split(".")) for key in COMMON],
            without=FIXED, opened=tuple(changed),
        )  # fmt: skip

    async def check(self) -> bool:
        """Whether the draft can be run as it is shown; says why not."""
        self._problem.text = ""
        refused = await self._form.settle()
        if refused:
            self._problem.text = f"not accepted yet: {', '.join(refused)}"
            return False
        try:
            await run.io_bound(self._draft.check)
        except (CdprError, OSError) as problem:
            self._problem.text = message(problem)
        return not self._problem.text
