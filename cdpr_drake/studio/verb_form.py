"""Forms of verbs: an input for each option, from the declarations that make the command line.

What is filled in becomes words of a command line, and the command line's own parser checks them. So
a verb needs no line here, and an option of a new type gets its input from the type's one entry in
`analyses.frame.words`: its choices, its place holder, its words.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from inspect import Parameter
from typing import Any, get_args, get_origin

from cyclopts import Argument
from nicegui import ui

from cdpr_drake.errors import CdprError
from cdpr_drake.studio.files import WorkingFolder

PLACES = ("--out", "--overwrite")
"""Options that say where results go, which the studio does."""

MOST_OPEN, LONGEST_REFUSAL = 6, 400
"""Options that are shown unfolded where a panel does not say which, and characters of a refusal
beside a field."""

YES, NO = "yes", "no"

Filled = dict[str, dict[str, str | bool]]
"""What was filled into forms, by verb and option; it outlives the page."""


class Option:
    """An option of a verb, or a word that stands by itself.

    Attributes:
        argument: As the command line declares it.
        key: Its name without dashes.
        is_switch: True if it takes no value.
        many: True if it may be repeated; a form separates the values by semicolons.
        default: Its default; empty: none.
    """

    def __init__(self, argument: Argument) -> None:
        """Of an argument of a command line."""
        hint, default = argument.hint, argument.field_info.default
        converter = argument.parameter.converter
        self.argument, self.key = argument, argument.name.lstrip("-").lower()
        self.is_switch = bool in (hint, *get_args(hint))
        self.many = bool(getattr(converter, "many", get_origin(hint) is Sequence))
        if isinstance(default, tuple | list):
            default = ",".join(map(str, default))
        words = "" if default is None or default is Parameter.empty else str(default)
        self.default: str | bool = default is True if hint is bool else words

    def words(self, value: str | bool) -> list[str]:
        """Words of a command line; none where the value is empty or the default."""
        names = self.argument.names  # of a switch for yes, then for no
        if value in (self.default, ""):
            return []
        if self.is_switch:
            return [names[0 if value in (True, YES) else -1]]
        values = str(value).split(";") if self.many else [str(value)]
        before = f"{self.argument.name}=" if self.is_named else ""
        return [before + part.strip() for part in values]

    @property
    def is_named(self) -> bool:
        """False of a word that stands by itself."""
        return self.argument.name.startswith("--")

    @property
    def metavar(self) -> str:
        """What the help shows in the place of its value."""
        return str(self.argument.parameter.metavar or "")


@dataclass(frozen=True)
class Verb:
    """A verb that a command calls.

    Attributes:
        name: Words of the command, such as `plan --free`.
        line: What it answers.
        arguments: Gives its arguments, and imports it for that.
        check: Parses words of a command line; raises a CdprError.
    """

    name: str
    line: str
    arguments: Callable[[], Sequence[Argument]]
    check: Callable[[Sequence[str]], object]

    @cached_property
    def options(self) -> dict[str, Option]:
        """Its options by their keys, in the order of the help."""
        return {option.key: option for option in map(Option, self.arguments())}

    @property
    def title(self) -> str:
        """Its name as part of a file's."""
        return self.name.replace(" --", "-")

    @property
    def writes_folder(self) -> bool:
        """True if it writes a folder of results, whose place is given to it."""
        return "out" in self.options and self.options["out"].metavar == "FOLDER"

    @property
    def needs_robot(self) -> bool:
        """True if no robot is taken where none is named."""
        return "robot" in self.options and bool(self.options["robot"].argument.required)

    def words(self, values: Mapping[str, str | bool], folder: WorkingFolder) -> list[str]:
        """The command line with these values by key, accepted but not run.

        Raises:
            CdprError: As `accept`; the verb itself may refuse more.
        """
        name, *forms = self.name.split()
        words = [name, *(form for form in forms if form.lstrip("-") not in self.options)]
        by_themselves: list[str] = []
        for key, option in self.options.items():
            made = option.words(values.get(key, option.default))
            (words if option.is_named else by_themselves).extend(made)
        words += ["--", *by_themselves] if by_themselves else []
        self.accept(words, folder)
        return words

    def accept(self, words: Sequence[str], folder: WorkingFolder) -> None:
        """Refuses words of a command line that the page may not start, or the parser refuses.

        Raises:
            CdprError: Words lead out of the working folder, say where results go, or are not
                accepted by the command.
        """
        for word in words:
            if self.writes_folder and word.partition("=")[0] in PLACES:
                raise CdprError(f"found {word[:60]!r}; accepted: an option of the form")
            option, mark, value = word.partition("=") if word.startswith("--") else ("", "", word)
            try:
                for part in filter(None, re.split(r"[=,;:\s\[\]{}'\"]+", value)):
                    folder.path(part)
            except CdprError as problem:
                raise CdprError(f"{option}{': ' if mark else ''}{problem}") from problem
        try:
            self.check(words)
        except CdprError as problem:
            raise CdprError(re.sub(r"; see cdpr .* --help$", "", str(problem))) from problem

    def field_of(self, refusal: str) -> str:
        """Key of the option that a refusal is about; empty: of none."""
        names = re.findall(r"--[a-z][a-z-]*|^[A-Z]+(?=:)", refusal)
        keys = (name.lstrip("-").lower() for name in names)
        return next((key for key in keys if key in self.options), "")


class VerbForm:
    """Inputs for the options of a verb, in the current slot."""

    def __init__(
        self, verb: Verb, filled: Filled, folder: WorkingFolder, files: Sequence[str], *,
        first: Sequence[str] = (), without: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Places them, with what was `filled` in before, and is from now on.

        Of the folder `files` are offered beside names of the package. Options of the keys `first`
        are shown unfolded; none: some. Those of the keys `without` have no input.
        """
        self.verb, self._folder, self._files = verb, folder, files
        self._values = filled.setdefault(verb.name, {})
        self._inputs: dict[str, Any] = {}
        places = [name.lstrip("-") for name in PLACES] if verb.writes_folder else []
        options = {key: o for key, o in verb.options.items() if key not in {*places, *without}}
        needed = [key for key, o in options.items() if o.argument.required or not o.is_named]
        unfolded = dict.fromkeys([*needed, *(first or list(options)[:MOST_OPEN])])
        self._place({key: options.pop(key) for key in unfolded})
        if options:
            more = ui.expansion("More options").classes("w-full studio-group").mark("more-options")
            with more:
                self._place(options)

    async def words(self, given: Mapping[str, str]) -> list[str]:
        """The command line with what is filled in and given; another thread parses it.

        Returns:
            Its words; none: a value is refused, and its field says so.

        Raises:
            CdprError: A value is refused that has no field.
        """
        for each in self._inputs.values():
            each.error = None
        try:
            return await asyncio.to_thread(self.verb.words, {**self._values, **given}, self._folder)
        except CdprError as problem:
            if self.say(str(problem)):
                return []
            raise

    def say(self, refusal: str) -> bool:
        """Says what was refused beside the field that it names; False if none can."""
        field = self._inputs.get(self.verb.field_of(refusal))
        if field is not None:
            field.error = refusal[:LONGEST_REFUSAL]
        return field is not None

    def _place(self, options: Mapping[str, Option]) -> None:
        with ui.element("div").classes("studio-form"):
            for key, option in options.items():
                ui.label(key.replace("-", " ")).classes("studio-label")
                made = self._input(option, self._values.get(key, option.default))
                made.classes("w-full").mark(f"{self.verb.title}-{key}")
                made.on_value_change(lambda event, key=key: self._take(key, event.value))

    def _input(self, option: Option, value: str | bool) -> Any:
        parameter, fixed = option.argument.parameter, option.argument.get_choices()
        help = " ".join(str(parameter.help or "").split()).removesuffix(".")
        if isinstance(option.default, bool):
            return ui.checkbox(help, value=bool(value))
        completer: Any = parameter.completer  # ours need no context
        offered = completer(None) if callable(completer) else ()
        choices = [YES, NO] if option.is_switch else list(map(str, fixed or offered))
        words = str(value)
        if not choices or option.many:
            made: Any = ui.input(
                value="" if words == option.default else words,
                placeholder=option.default or None, autocomplete=choices,
            )  # fmt: skip
        elif option.metavar.endswith(",..."):  # several with commas between
            chosen = [part for part in words.split(",") if part in choices]
            made = ui.select(choices, value=chosen, multiple=True).props("use-chips")
        elif fixed or option.is_switch:
            one = words if words in choices else None
            made = ui.select(choices, value=one, clearable=not option.default)
        else:
            choices = list(dict.fromkeys([*choices, *self._files, *filter(None, [words])]))
            made = ui.select(
                choices, value=words or None, clearable=True, with_input=True,
                new_value_mode="add-unique",
            )  # fmt: skip
        if isinstance(made, ui.select):
            made.props(f'label="{option.key}"').classes("studio-named")
        made.props(f'hide-bottom-space options-dense aria-label="{option.key}"')
        made.props["hint"] = f"{help}; several by semicolons" if option.many else help
        self._inputs[option.key] = made
        return made

    def _take(self, key: str, value: Any) -> None:
        if isinstance(value, list):
            value = ",".join(value)
        self._values[key] = value if isinstance(value, bool) else str(value or "")
