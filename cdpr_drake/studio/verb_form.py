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
from cdpr_drake.studio.folder import WorkingFolder

PLACES = ("--out", "--overwrite")
"""Options that say where results go, which the studio does."""

MOST_OPEN = 6
"""Options that are shown unfolded where a panel does not say which."""

YES, NO = "yes", "no"

LONGEST_REFUSAL = 400
"""Characters of a refusal beside a field."""

Filled = dict[str, dict[str, str | bool]]
"""What was filled into forms, by verb and option; it outlives the page."""


class Option:
    """An option of a verb, or a word that stands by itself.

    Attributes:
        name: As the help shows it, with dashes if it has any.
        key: The same without dashes.
        help: What it is, with units and ranges.
        default: Its default; empty: none.
        choices: Words that are offered.
        is_switch: True if it takes no value.
        is_free: True if it takes other words than `choices`.
        several: True if it takes several words with commas between.
        many: True if it may be repeated; a form separates the values by semicolons.
        required: True if a command needs it.
        takes_folder: True if it takes the path of a folder.
    """

    def __init__(self, argument: Argument) -> None:
        """Of an argument of a command line."""
        parameter, hint = argument.parameter, argument.hint
        metavar, default = str(parameter.metavar or ""), argument.field_info.default
        fixed, completer = argument.get_choices() or (), parameter.completer
        self.name, self._names = argument.name, argument.names  # of a switch for yes, then for no
        self.key = self.name.lstrip("-").lower()
        self.is_switch = bool in (hint, *get_args(hint))
        self.several = metavar.endswith(",...")
        self.many = bool(getattr(parameter.converter, "many", get_origin(hint) is Sequence))
        self.is_free = not fixed and not self.several
        self.required, self.takes_folder = bool(argument.required), metavar == "FOLDER"
        offered: Any = completer(None) if callable(completer) else ()  # type: ignore[arg-type]
        self.choices = [str(choice) for choice in fixed or offered]
        self.help = " ".join(str(parameter.help or "").split()).removesuffix(".")
        if self.many:
            self.help += "; several by semicolons"
        if isinstance(default, tuple | list):
            default = ",".join(map(str, default))
        is_empty = default is None or default is Parameter.empty
        self.default: str | bool = "" if is_empty else str(default)
        if hint is bool:
            self.default = default is True

    def words(self, value: str | bool) -> list[str]:
        """Words of a command line; none where the value is empty or the default."""
        if value in (self.default, ""):
            return []
        if self.is_switch:
            return [self._names[0 if value in (True, YES) else -1]]
        values = str(value).split(";") if self.many else [str(value)]
        before = f"{self.name}=" if self.name.startswith("--") else ""
        return [before + part.strip() for part in values]


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
        return "out" in self.options and self.options["out"].takes_folder

    @property
    def needs_robot(self) -> bool:
        """True if no robot is taken where none is named."""
        return "robot" in self.options and self.options["robot"].required

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
            (words if option.name.startswith("--") else by_themselves).extend(made)
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
        """Places them.

        Args:
            verb: The verb.
            filled: What was filled in before, and is from now on.
            folder: Where files are.
            files: Names of those that are offered beside names of the package.
            first: Keys of options that are shown unfolded; none: what is required, and some more.
            without: Keys of options that have no input, since the panel gives their values.
        """
        self.verb, self._folder, self._files = verb, folder, files
        self._values = filled.setdefault(verb.name, {})
        self._inputs: dict[str, Any] = {}
        places = [name.lstrip("-") for name in PLACES] if verb.writes_folder else []
        options = {key: o for key, o in verb.options.items() if key not in {*places, *without}}
        needed = [key for key, o in options.items() if o.required or not o.name.startswith("--")]
        shown = list(dict.fromkeys([*needed, *(first or list(options)[:MOST_OPEN])]))
        folded = [key for key in options if key not in shown]
        self._place([options[key] for key in shown])
        if folded:
            more = ui.expansion("More options").classes("w-full studio-group").mark("more-options")
            with more:
                self._place([options[key] for key in folded])

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

    def _place(self, options: Sequence[Option]) -> None:
        with ui.element("div").classes("studio-form"):
            for option in options:
                key = option.key
                ui.label(key.replace("-", " ")).classes("studio-label")
                made = self._input(option, self._values.get(key, option.default))
                made.classes("w-full").mark(f"{self.verb.title}-{key}")
                made.on_value_change(lambda event, key=key: self._take(key, event.value))

    def _input(self, option: Option, value: str | bool) -> Any:
        if isinstance(option.default, bool):
            return ui.checkbox(option.help, value=bool(value))
        choices, words = [YES, NO] if option.is_switch else list(option.choices), str(value)
        if not choices or option.many:
            shown = "" if words == option.default else words
            before = option.default or None
            made: Any = ui.input(value=shown, placeholder=before, autocomplete=choices)
        else:
            made = self._select(option, choices, words)
            made.props(f'label="{option.key}"').classes("studio-named")
        made.props(f'dense outlined hide-bottom-space options-dense aria-label="{option.key}"')
        made.props["hint"] = option.help
        self._inputs[option.key] = made
        return made

    def _select(self, option: Option, choices: list[str], value: str) -> ui.select:
        if option.several:
            chosen = [part for part in value.split(",") if part in choices]
            return ui.select(choices, value=chosen, multiple=True).props("use-chips")
        if option.is_free and not option.is_switch:
            offered = dict.fromkeys([*choices, *self._files, *filter(None, [value])])
            return ui.select(
                list(offered), value=value or None, clearable=True, with_input=True,
                new_value_mode="add-unique",
            )  # fmt: skip
        one = value if value in choices else None
        return ui.select(choices, value=one, clearable=not option.default)

    def _take(self, key: str, value: Any) -> None:
        if isinstance(value, list):
            value = ",".join(value)
        self._values[key] = value if isinstance(value, bool) else str(value or "")
