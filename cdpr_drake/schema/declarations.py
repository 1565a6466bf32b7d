"""Settings: dataclasses whose fields say in their type what they accept, and what they mean.

    @settings
    class Friction:
        coulomb: Annotated[float, In("N m", ge=0.0), "Coulomb friction F_c."]

They are plain dataclasses, so `replace`, `fields`, `asdict` and pickle work, and code may make them
unchecked. `typed_yaml` checks what files say, by pydantic, which is imported with the first file.
Annotations are not postponed where settings are declared: `help` shows what they say.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
import types
import typing
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, dataclass_transform, get_args, get_origin

import numpy as np

SMALLEST, LARGEST = 1e-100, 1e30
"""Accepted sizes of numbers other than 0, in any unit: their cubes are floats, too."""

LONGEST = 1e4
"""Largest coordinate and edge [m]; the longest cables that were built measure kilometres."""

FASTEST = 1e5
"""Largest rate of images, control steps and rows of a log [Hz]."""

NAME = r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}"
"""Pattern of names of scenarios, robots, cables."""

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
"""Characters that control a terminal; ends of lines and tabs are text."""

_FIELDS = "Attributes:"
"""Title of the fields in the docstring of a class of settings."""


@dataclass_transform(kw_only_default=True, field_specifiers=(dataclasses.field,))
def settings(kind: Any = None, *, repr: bool = True) -> Any:
    """Makes a class of settings: a dataclass with keyword arguments; `help` has all its fields."""
    if kind is None:
        return lambda kind: settings(kind, repr=repr)
    made = dataclasses.dataclass(kw_only=True, repr=repr)(kind)
    made.__pydantic_config__ = {"extra": "forbid"}
    own = inspect.cleandoc(vars(kind).get("__doc__") or "").partition(_FIELDS)[0].strip()
    if own.startswith(f"{kind.__name__}("):  # what `dataclass` writes where there is nothing
        own = f"{kind.__name__}."
    fields = settings_of(made).values()
    listed = "".join(f"\n    {one.name}: {one.help()}" for one in fields)
    made.__doc__ = f"{own}\n\n{_FIELDS}{listed}"
    this = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    made.__init__.__signature__ = inspect.Signature([this, *(one.parameter() for one in fields)])
    return made


def filled(factory: Callable[[], Any]) -> Any:
    """A default that `factory` makes anew for each object."""
    return dataclasses.field(default_factory=factory)


def values(*numbers: Any) -> Any:
    """An array as default."""
    return filled(lambda: np.array(numbers, float))


class Rule:
    """What a field accepts, in a type `Annotated[kind, rule, words]`.

    The kind may be one value, `list[...]` or `dict[str, ...]` of it, and may have `| None`.
    """

    def words(self, kind: Any, found: str = "") -> str:
        """Words for what one value may be, such as `a number > 0 [kg]`, where `found` was found."""
        raise NotImplementedError

    def core(self, kind: Any) -> Any:
        """The schema of pydantic_core that checks one value."""
        raise NotImplementedError

    def json(self, kind: Any) -> dict[str, Any]:
        """The JSON schema of one value."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, kind: Any, handler: Any) -> Any:
        """The same of the whole type, as pydantic asks for it."""
        from pydantic_core import core_schema

        inside = get_args(kind)
        if type(None) in inside:
            return core_schema.nullable_schema(
                self.__get_pydantic_core_schema__(inside[0], handler)
            )
        if get_origin(kind) is list:
            return core_schema.list_schema(self.__get_pydantic_core_schema__(inside[0], handler))
        if get_origin(kind) is dict:
            one = self.__get_pydantic_core_schema__(inside[1], handler)
            return core_schema.dict_schema(core_schema.str_schema(), one)
        return self.core(kind)


@dataclasses.dataclass(init=False, frozen=True, eq=False)
class In(Rule):
    """Numbers in a unit and within bounds; with a shape an array, None: any length but zero.

    Attributes:
        unit: Unit.
        shape: Of the array; () for one number.
        bounds: Of each number, by `gt`, `ge`, `lt`, `le`.
        single: True if one number counts as an array of it.
        direction: True if an array of zeros is refused.
    """

    unit: str
    shape: tuple[int | None, ...]
    bounds: dict[str, float]
    single: bool
    direction: bool

    def __init__(
        self,
        unit: str = "",
        *shape: int | None,
        single: bool = False,
        direction: bool = False,
        **bounds: float,
    ) -> None:
        """As the attributes say."""
        vars(self).update(unit=unit, shape=shape, bounds=bounds, single=single, direction=direction)

    def words(self, kind: Any, found: str = "") -> str:
        """See Rule; a number of a size without sense adds words."""
        words = "a whole number" if kind is int else "a number"
        if self.shape:
            words = " x ".join("n" if n is None else str(n) for n in self.shape) + " numbers"
            words += ", not all zero" * self.direction
        signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
        bounds = " and ".join(f"{signs[sign]} {value:g}" for sign, value in self.bounds.items())
        words = " ".join(filter(None, (words, bounds, self.unit and f"[{self.unit}]")))
        if _is_without_sense(found):
            words += f", 0 or of a size from {SMALLEST:g} to {LARGEST:g}"
        return words

    def core(self, kind: Any) -> Any:
        """See Rule."""
        from pydantic_core import core_schema

        bounded: Any = core_schema.int_schema if kind is int else core_schema.float_schema
        schema = core_schema.no_info_before_validator_function(_number, bounded(**self.bounds))
        for n in reversed(self.shape):
            rows = core_schema.list_schema(schema)
            schema = core_schema.no_info_before_validator_function(self._listed(n), rows)
        if not self.shape:
            return schema
        return core_schema.no_info_after_validator_function(self._array, schema)

    def _array(self, rows: list[Any]) -> np.ndarray:
        made = np.array(rows, float)
        if self.direction and not made.any():
            raise ValueError
        return made

    def _listed(self, length: int | None) -> Callable[[Any], Any]:
        """Refuses what is no list of a length, before its items are looked at."""

        def checked(value: Any) -> Any:
            if self.single and isinstance(value, str):
                return [value]
            if not isinstance(value, list) or len(value) != (length or max(1, len(value))):
                raise ValueError
            return value

        return checked

    def json(self, kind: Any) -> dict[str, Any]:
        """See Rule."""
        names = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum",
                 "le": "maximum"}  # fmt: skip
        made: dict[str, Any] = {"type": "integer" if kind is int else "number"}
        made |= {names[sign]: value for sign, value in self.bounds.items()}
        one = made
        for n in reversed(self.shape):
            made = {"type": "array", "items": made, "minItems": n or 1}
            made |= {} if n is None else {"maxItems": n}
        return {"anyOf": [one, made]} if self.single else made


def _number(words: Any) -> float:
    """A number as Python reads its words: 1e3 and 010, not 1:30."""
    if not isinstance(words, str):
        raise ValueError
    value = float(words)
    if not _has_sense(value):
        raise ValueError
    return value


def _has_sense(value: float) -> bool:
    return value == 0.0 or SMALLEST <= abs(value) <= LARGEST


def _is_without_sense(words: str) -> bool:
    """Whether words are a number that is finite and of no sensible size."""
    try:
        value = float(words)
    except ValueError:
        return False
    return math.isfinite(value) and not _has_sense(value)


@dataclasses.dataclass(frozen=True, eq=False)
class OneOf(Rule):
    """A word of a collection, which may grow after the class was made."""

    choices: Collection[str]

    def words(self, kind: Any, found: str = "") -> str:
        """See Rule."""
        return "one of " + ", ".join(self.choices)

    def core(self, kind: Any) -> Any:
        """See Rule."""
        return _text_core(lambda words: words in self.choices)

    def json(self, kind: Any) -> dict[str, Any]:
        """See Rule."""
        return {"type": "string", "enum": list(self.choices)}


@dataclasses.dataclass(frozen=True)
class _TextRule(Rule):
    pattern: str = ""
    accepted: str = "text"

    def words(self, kind: Any, found: str = "") -> str:
        if not self.pattern and _CONTROL.search(found):
            return "no control characters"
        return self.accepted

    def core(self, kind: Any) -> Any:
        return _text_core(
            lambda words: (
                not _CONTROL.search(words)
                and bool(not self.pattern or re.fullmatch(self.pattern, words))
            )
        )

    def json(self, kind: Any) -> dict[str, Any]:
        return {"type": "string"} | ({"pattern": f"^{self.pattern}$"} if self.pattern else {})


def _text_core(is_accepted: Callable[[str], bool]) -> Any:
    from pydantic_core import core_schema

    def checked(words: str) -> str:
        if not is_accepted(words):
            raise ValueError
        return str(words)

    return core_schema.no_info_after_validator_function(checked, core_schema.str_schema())


class _SwitchRule(Rule):
    _values: typing.ClassVar = {"yes": True, "true": True, "on": True,
                                "no": False, "false": False, "off": False}  # fmt: skip

    def words(self, kind: Any, found: str = "") -> str:
        return "true or false"

    def core(self, kind: Any) -> Any:
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(self._checked)

    def _checked(self, words: Any) -> bool:
        if getattr(words, "tag", "") != "bool" or words.lower() not in self._values:
            raise ValueError
        return bool(self._values[words.lower()])

    def json(self, kind: Any) -> dict[str, Any]:
        return {"type": "boolean"}


Direction = Annotated[np.ndarray, In("-", 3, direction=True)]
"""A vector of any length but zero."""

Point = Annotated[np.ndarray, In("m", 3, ge=-LONGEST, le=LONGEST)]
"""A point in space."""

Switch = Annotated[bool, _SwitchRule()]
"""True or false."""

Text = Annotated[str, _TextRule()]
"""Any text without control characters."""

Name = Annotated[str, _TextRule(NAME, "1 to 64 letters, digits, _ . -, the first one no dot")]
"""A name that may become that of a file: no folders, no dots at its start."""


@dataclasses.dataclass(frozen=True)
class Setting:
    """A field of a class of settings.

    Attributes:
        name: Its name.
        doc: What it means.
        type: The type of one value.
        rule: What one value may be; None: a section.
        many: `list` or `dict` of values; None: one value.
        nullable: True if it may be null.
        field: The field of the dataclass, with its default.
    """

    name: str
    doc: str
    type: Any
    rule: Rule | None
    many: type | None
    nullable: bool
    field: dataclasses.Field[Any]

    @property
    def section(self) -> Any:
        """The class of settings of one value; None: no section."""
        return self.type if self.rule is None else None

    @property
    def kind(self) -> str:
        """A number, whole, array, text, texts, switch, section, sections or named (a mapping)."""
        if self.many is dict:
            return "named"
        kind = {bool: "switch", int: "whole", float: "number", np.ndarray: "array", str: "text"}
        return kind.get(self.type, "section") + "s" * (self.many is list)

    @property
    def required(self) -> bool:
        """True if a file has to give it."""
        missing = dataclasses.MISSING
        return self.field.default is missing and self.field.default_factory is missing

    @property
    def default(self) -> Any:
        """Its value where a file does not give it, made anew."""
        factory = self.field.default_factory
        return self.field.default if factory is dataclasses.MISSING else factory()

    @property
    def unit(self) -> str:
        """Unit of a number, or empty."""
        return self.rule.unit if isinstance(self.rule, In) else ""

    @property
    def shape(self) -> tuple[int | None, ...]:
        """Shape of an array, or ()."""
        return self.rule.shape if isinstance(self.rule, In) else ()

    @property
    def choices(self) -> Collection[str]:
        """Words to choose from, or ()."""
        return self.rule.choices if isinstance(self.rule, OneOf) else ()

    def accepts(self, found: str = "") -> str:
        """Words for what it may be, where `found` was found."""
        if self.many is None:
            words = self.rule.words(self.type, found) if self.rule else "a mapping"
        else:
            of = "mappings" if self.section else "numbers" if self.shape else "texts"
            of = ", ".join(self.choices) or of
            words = f"a list of {of}" if self.many is list else f"a mapping from names to {of}"
        return words + " or null" * self.nullable

    def help(self) -> str:
        """What it means and accepts, in two sentences."""
        return f"{self.doc} Accepted: {self.accepts().removesuffix('.')}."

    def parameter(self) -> inspect.Parameter:
        """A keyword argument for `help`: plain type, and default, ... where that is a section."""
        kind: Any = self.type
        if self.many:
            kind = list[kind] if self.many is list else dict[str, kind]
        default = inspect.Parameter.empty if self.required else self.default
        return inspect.Parameter(
            self.name,
            inspect.Parameter.KEYWORD_ONLY,
            annotation=kind | None if self.nullable else kind,
            default=... if dataclasses.is_dataclass(default) else default,
        )


_KNOWN: dict[type, dict[str, Setting]] = {}


def settings_of(schema: type) -> dict[str, Setting]:
    """The fields of a class of settings by name, collected once; do not change them."""
    if schema not in _KNOWN:
        hints = typing.get_type_hints(schema, include_extras=True)
        fields = dataclasses.fields(schema)
        _KNOWN[schema] = {field.name: _setting(field, hints[field.name]) for field in fields}
    return _KNOWN[schema]


def _setting(field: dataclasses.Field[Any], hint: Any) -> Setting:
    kind, many, nullable = hint, None, False
    notes: list[Any] = []
    while get_args(kind):
        origin, inside = get_origin(kind), get_args(kind)
        if origin is Annotated:
            notes += kind.__metadata__
            kind = inside[0]
        elif origin in (typing.Union, types.UnionType):
            nullable, kind = True, next(one for one in inside if one is not type(None))
        elif origin in (list, dict):
            many, kind = origin, inside[-1]
        else:  # such as an array of a type of numbers
            break
    rule = next((note for note in notes if isinstance(note, Rule)), None)
    doc = next((note for note in notes if isinstance(note, str)), "")
    return Setting(field.name, doc, kind, rule, many, nullable, field)


Refusal = tuple[str, object, str]
"""A key within a section, empty for itself, or after a / a key of the whole file; what was found
there, in words; what is accepted, or empty if the words before say it."""


@dataclasses.dataclass(frozen=True)
class Scope:
    """Surroundings of a section, for its `refusals`.

    A class of settings may have a method `refusals(scope)` that yields a `Refusal` for each
    combination of its fields, or with the scope, that is not accepted. An exception is passed over
    if the section or one within it refuses something, since it may follow from that.

    Attributes:
        whole: The settings of the whole file.
        path: The file; None: code made them.
        robot: The robot or mechanism of a scenario.
        more: Functions that yield further refusals of the whole.
    """

    whole: Any
    path: Path | None = None
    robot: Any = None
    more: tuple[Callable[[Scope], Iterator[Refusal]], ...] = ()


def told(problem: Exception, key: str) -> Refusal:
    """A refusal in the words of an error, which may begin with a key of their own."""
    own = re.match(r"([a-z_]+(?:\.[a-z_0-9]+|\[\d+\])+): (found .*)", str(problem))
    return (own[1], own[2], "") if own else (key, str(problem), "")


def repeated(names: Iterable[str], key: str) -> Iterator[Refusal]:
    """Refuses names that come twice; `key` has {} for their place in a list."""
    seen: set[str] = set()
    for k, name in enumerate(names):
        if name in seen:
            yield key.format(k), f"{name} twice", "each name once"
        seen.add(name)


def number_words(values: Iterable[float]) -> str:
    """Numbers as "(1, 2, 3)", for messages."""
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
