"""A scenario whose fields are changed: what the form shows, and whether it can be run."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

import cdpr_drake
from cdpr_drake.analyses.runs.steering import UNTOUCHED, check_steered
from cdpr_drake.errors import CdprError, DataFileError, ScenarioError
from cdpr_drake.schema.declarations import Setting, settings_of
from cdpr_drake.schema.typed_yaml import plain_values
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import check_moves_robot

COMMON = (
    "duration", "seed", "camera.kind", "controller.scheme", "controller.lambda_0",
    "controller.lambda_infinity", "estimator.kind", "distribution.method", "controller.stiffness",
    "controller.damping", "integration.engine", "log_rate",
)  # fmt: skip
"""Fields that most people change, those of them that a scenario has."""

FIXED = frozenset({"kind", "name", "title", "source"})
"""Fields that say what a scenario is; who wants others writes a file."""

ROBOT = "robot"
"""The field that a form does not have: a run is of the robot that is open."""

_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(?:\[\d+\])?(?:\.[A-Za-z_][A-Za-z0-9_]*(?:\[\d+\])?)*")


@dataclass(frozen=True)
class FormField:
    """One field.

    Attributes:
        key: As in --set, such as controller.lambda_0.
        rule: What is accepted.
        text: What the scenario has there, as YAML; text without quotes.
    """

    key: str
    rule: Setting
    text: str


@dataclass(frozen=True)
class FormSection:
    """Fields that belong together.

    Attributes:
        key: As in --set; empty for the scenario itself.
        doc: What it is, in one line.
        fields: Its fields.
        sections: Sections in it.
    """

    key: str
    doc: str
    fields: tuple[FormField, ...]
    sections: tuple[FormSection, ...]

    def all_fields(self) -> Iterator[FormField]:
        """Its fields and those of its sections."""
        yield from self.fields
        for section in self.sections:
            yield from section.all_fields()


class ScenarioDraft:
    """A scenario by name or by path, and what is changed of it.

    Attributes:
        name: Name of one of the package, or absolute path of a file in the working folder.
        form: Its fields, as the file has them.
        changes: Texts that replace them, by key.
    """

    def __init__(self, name: str, folder: Path) -> None:
        """Reads it.

        Args:
            name: As the attribute.
            folder: Working folder.

        Raises:
            CdprError: It is not accepted, or names files outside of the folder.
        """
        self.name, self._folder = name, folder.resolve()
        check_moves_robot(name, "the studio")
        scenario = load_scenario(name)
        check_files(scenario, self._folder)
        self.form = _section(type(scenario), plain_values(scenario), "", "")
        self._fields = {field.key: field for field in self.form.all_fields()}
        self.changes: dict[str, str] = {}

    def field(self, key: str) -> FormField | None:
        """The field of a key; None: there is none."""
        return self._fields.get(key)

    def change(self, key: str, text: str) -> None:
        """Replaces what a field has; the text that the file has takes the change back.

        Raises:
            ScenarioError: There is no such field.
        """
        if key not in self._fields:
            raise ScenarioError(f"{key}: there is no such field in this scenario")
        if text.strip() == self._fields[key].text:
            self.changes.pop(key, None)
        else:
            self.changes[key] = text.strip()

    @property
    def own_robot(self) -> str:
        """The robot of the file, by its name or the path of its file."""
        return self._fields[ROBOT].text

    def settings(self) -> tuple[str, ...]:
        """What --set is given."""
        made = []
        for key, text in self.changes.items():
            rule = self._fields[key].rule
            value = text
            if text == "" and rule.nullable:
                value = "null"
            elif rule.kind == "text" and not (text == "null" and rule.nullable):
                value = json.dumps(text)
            made.append(f"{key}={value}")
        return tuple(made)

    def by_hand(self) -> tuple[str, ...]:
        """What --set is given besides, so that cables can be broken and the platform pushed.

        Of the sections that this takes, those that the scenario has not and accepts.
        """
        made: list[str] = []
        for key, least in UNTOUCHED.values():
            field = self._fields.get(key)
            if field is None or self.changes.get(key, field.text) != "null":
                continue
            with suppress(CdprError):
                load_scenario(self.name, (*self.settings(), *made, f"{key}={least}"))
                made.append(f"{key}={least}")
        return tuple(made)

    def check(self) -> Any:
        """The scenario as it would be run.

        Raises:
            CdprError: It is not accepted.
        """
        for key, text in self.changes.items():
            self._check_robot_path(key, text)
        scenario = load_scenario(self.name, self.settings())
        check_files(scenario, self._folder)
        check_steered(scenario)
        return scenario

    def _check_robot_path(self, key: str, text: str) -> None:
        """Refuses what is no name and leads out of the folder, before anything is read."""
        if self._fields[key].rule.kind != "text" or "/" not in text:
            return
        beside = Path(self.name).parent if Path(self.name).is_absolute() else self._folder
        if not any(_is_inside(base / text, self._folder) for base in {beside, self._folder}):
            raise ScenarioError(
                f"--set {key}: found {text[:80]}; accepted: a file in the working folder"
            )

    def problems(self, problem: DataFileError) -> tuple[dict[str, str], list[str]]:
        """What is wrong by the key of the field where it is to be said, and what is left."""
        by_key: dict[str, str] = {}
        rest: list[str] = []
        for line in str(problem).splitlines():
            key, words = self._located(line)
            if key:
                by_key[key] = f"{by_key[key]}\n{words}" if key in by_key else words
            else:
                rest.append(line)
        return by_key, rest

    def _located(self, line: str) -> tuple[str, str]:
        """Key of the field that a message is about, empty if none is, and the message for there."""
        for part in re.finditer(r"(?:^|[ :])(?=[A-Za-z_])", line):
            found = _KEY.match(line, part.end())
            if found is None or not line.startswith(":", found.end()):
                continue
            key = re.sub(r"\[\d+\].*", "", found[0])
            if key in self._fields:
                return key, line[found.end() + 1 :].strip()
        return "", line


def _section(schema: type, values: dict[str, Any], key: str, doc: str) -> FormSection:
    fields: list[FormField] = []
    sections: list[FormSection] = []
    for name, rule in settings_of(schema).items():
        full, value = f"{key}.{name}" if key else name, values.get(name)
        if not key and name in FIXED:
            continue
        if rule.kind == "section" and isinstance(value, dict):
            sections.append(_section(rule.section, value, full, rule.doc))
        else:
            fields.append(FormField(full, rule, _text(value)))
    return FormSection(key, doc, tuple(fields), tuple(sections))


def _text(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, str):
        return value
    return (
        yaml.safe_dump(value, default_flow_style=True, width=10_000).removesuffix("...\n").strip()
    )


def check_files(scenario: Any, folder: Path) -> None:
    """Refuses scenarios that name files outside of the working folder and of the package.

    Raises:
        ScenarioError: See above.
    """
    own = Path(cdpr_drake.__file__).resolve().parent
    allowed = (folder, own, own.parent / "models", own.parent / "systems")
    for key, text in _texts(scenario, ""):
        path = Path(text)
        if path.is_absolute() and not any(_is_inside(path, place) for place in allowed):
            raise ScenarioError(
                f"{scenario.name}: {key}: found {text[:80]}; accepted: a file in the working folder"
            )


def _texts(value: Any, key: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, str):
        yield key, value
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            name = f"{key}.{field.name}" if key else field.name
            yield from _texts(getattr(value, field.name), name)
    elif isinstance(value, list):
        for number, item in enumerate(value):
            yield from _texts(item, f"{key}[{number}]")


def _is_inside(path: Path, folder: Path) -> bool:
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):
        return False
