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
"""Options that are shown unfolded where a tab does not say which."""

YES, NO = "yes", "no"

LONGEST_REFUSAL = 400
"""Characters of a refusal beside a field."""

Filled = dict[str, dict[str, str | bool]]
"""What was filled into forms, by verb and option; it outlives the page."""


class FieldProblem(CdprError):
    """An option is not accepted; a field says it."""


@dataclass(frozen=True)
class Option:
    """An option of a verb, or a word that stands by itself.

    Attributes:
        name: As the help shows it, with dashes if it has any.
        names: As a command line has it; of a switch for yes, then for no.
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

    name: str
    names: tuple[str, ...]
    help: str
    default: str | bool
    choices: tuple[str, ...]
    is_switch: bool
    is_free: bool
    several: bool
    many: bool
    required: bool
    takes_folder: bool

    @property
    def key(self) -> str:
        """Its name without dashes."""
        return self.name.lstrip("-").lower()

    def words(self, value: str | bool) -> list[str]:
        """Words of a command line; none where the value is empty or the default."""
        if value == self.default or value == "":
            return []
        if self.is_switch:
            return [self.names[0 if value in (True, YES) else -1]]
        values = str(value).split(";") if self.many else [str(value)]
        before = f"{self.name}=" if self.name.startswith("--") else ""
        return [before + part.strip() for part in values]


def option_of(argument: Argument) -> Option:
    """The option that an argument of a command line is in a form."""
    parameter, default = argument.parameter, argument.field_info.default
    metavar = str(parameter.metavar or "")
    is_switch = bool in (argument.hint, *get_args(argument.hint))
    several = metavar.endswith(",...")
    many = getattr(parameter.converter, "many", get_origin(argument.hint) is Sequence)
    fixed = argument.get_choices() or ()
    completer: Any = parameter.completer  # ours need no context
    offered = completer(None) if callable(completer) else ()
    help = " ".join(str(parameter.help or "").split()).removesuffix(".")
    if is_switch and argument.hint is bool:
        default = default is True
    elif default is None or default is Parameter.empty:
        default = ""
    else:
        default = ",".join(map(str, default)) if isinstance(default, tuple | list) else str(default)
    return Option(
        argument.name, tuple(argument.names), f"{help}; several by semicolons" if many else help,
        default, tuple(map(str, fixed or offered)), is_switch, not fixed and not several, several,
        many, bool(argument.required), metavar == "FOLDER",
    )  # fmt: skip


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
        return {option.key: option for option in map(option_of, self.arguments())}

    @property
    def title(self) -> str:
        """Its name as part of a file's."""
        return self.name.replace(" --", "-")

    @property
    def writes_folder(self) -> bool:
        """True if it writes a folder of results, whose place is given to it."""
        return "out" in self.options and self.options["out"].takes_folder

    def words(self, values: Mapping[str, str | bool], folder: WorkingFolder) -> list[str]:
        """The command line with these values by key, parsed but not run.

        Raises:
            FieldProblem: A value is not accepted; the verb itself may refuse more.
        """
        name, *forms = self.name.split()
        words = [form for form in forms if form.lstrip("-") not in self.options]
        by_themselves: list[str] = []
        for key, option in self.options.items():
            made = option.words(values.get(key, option.default))
            (words if option.name.startswith("--") else by_themselves).extend(made)
        words = [name, *words, *(["--", *by_themselves] if by_themselves else [])]
        self.accept(words, folder)
        return words

    def accept(self, words: Sequence[str], folder: WorkingFolder) -> None:
        """Refuses words of a command line that the page may not start, or the parser refuses.

        Raises:
            FieldProblem: Words lead out of the working folder, say where results go, or are not
                accepted by the command.
        """
        try:
            for word in words:
                if self.writes_folder and word.partition("=")[0] in PLACES:
                    raise CdprError(f"found {word[:60]!r}; accepted: an option of the form")
                refuse_outside(word, folder)
            self.check(words)
        except CdprError as problem:
            said = re.sub(r"; see cdpr .* --help$", "", str(problem))
            raise FieldProblem(said[:LONGEST_REFUSAL]) from problem

    def field_of(self, refusal: str) -> str:
        """Key of the option that a refusal is about; empty: of none."""
        names = re.findall(r"--[a-z][a-z-]*|^[A-Z]+(?=:)", refusal)
        keys = (name.lstrip("-").lower() for name in names)
        return next((key for key in keys if key in self.options), "")


def refuse_outside(word: str, folder: WorkingFolder) -> None:
    """Refuses a word of a command line that may name a file outside of the working folder.

    Raises:
        CdprError: See above; names the option.
    """
    option, mark, value = word.partition("=") if word.startswith("--") else ("", "", word)
    for part in re.split(r"[=,;:\s\[\]{}'\"]+", value):
        try:
            _ = folder.path(part) if part.strip() else None
        except CdprError as problem:
            raise CdprError(f"{option}{': ' if mark else ''}{problem}") from problem


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
            without: Keys of options that have no input, since the tab gives their values.
        """
        self.verb, self._folder, self._files = verb, folder, files
        self._values = filled.setdefault(verb.name, {})
        self._inputs: dict[str, Any] = {}
        places = [name.lstrip("-") for name in PLACES] if verb.writes_folder else []
        options = {key: o for key, o in verb.options.items() if key not in {*places, *without}}
        needed = [key for key, o in options.items() if o.required or not o.name.startswith("--")]
        shown = list(dict.fromkeys([*needed, *(first or list(options)[:MOST_OPEN])]))
        with ui.element("div").classes("studio-form"):
            for key in shown:
                self._place(options[key])
        if len(options) > len(shown):
            folded = ui.expansion("More options").classes("w-full studio-group")
            with folded.mark("more-options"), ui.element("div").classes("studio-form"):
                for key, option in options.items():
                    if key not in shown:
                        self._place(option)

    async def words(self, given: Mapping[str, str]) -> list[str]:
        """The command line with what is filled in and given; another thread parses it.

        Raises:
            FieldProblem: A value is not accepted; its field says so, if it has one.
        """
        for each in self._inputs.values():
            each.error = None
        try:
            return await asyncio.to_thread(self.verb.words, {**self._values, **given}, self._folder)
        except FieldProblem as problem:
            if not self.say(str(problem)):
                raise CdprError(str(problem)) from problem
            raise

    def say(self, refusal: str) -> bool:
        """Says what was refused beside the field that it names; False if none can."""
        field = self._inputs.get(self.verb.field_of(refusal))
        if field is not None:
            field.error = refusal
        return field is not None

    def _place(self, option: Option) -> None:
        key = option.key
        value = self._values.get(key, option.default)
        ui.label(key.replace("-", " ")).classes("studio-label")
        if option.is_switch and isinstance(option.default, bool):
            made: Any = ui.checkbox(option.help, value=bool(value))
        else:
            made = self._input(option, str(value))
            made.props(f'dense outlined hide-bottom-space options-dense aria-label="{key}"')
            made.props["hint"] = option.help
            self._inputs[key] = made
        made.classes("w-full").mark(f"{self.verb.title}-{key}")
        made.on_value_change(lambda event: self._take(key, event.value))

    def _input(self, option: Option, value: str) -> Any:
        choices = [YES, NO] if option.is_switch else list(option.choices)
        if not choices or option.many:
            default = str(option.default)
            shown = "" if value == default else value
            return ui.input(value=shown, placeholder=default or None, autocomplete=choices)
        if option.several:
            chosen = [part for part in value.split(",") if part in choices]
            made = ui.select(choices, value=chosen, multiple=True).props("use-chips")
        elif option.is_free and not option.is_switch:
            choices += [*self._files, *([value] if value else [])]
            made = ui.select(
                list(dict.fromkeys(choices)), value=value or None, clearable=True, with_input=True,
                new_value_mode="add-unique",
            )  # fmt: skip
        else:
            one = value if value in choices else None
            made = ui.select(choices, value=one, clearable=not option.default)
        return made.props(f'label="{option.key}"').classes("studio-named")

    def _take(self, key: str, value: Any) -> None:
        if isinstance(value, list):
            value = ",".join(value)
        self._values[key] = value if isinstance(value, bool) else str(value or "")
