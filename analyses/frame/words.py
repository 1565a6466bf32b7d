"""Types of arguments that verbs share: the words of a command line that each of them takes.

A verb names a type once, and its value, option, help, completion and refusals follow from it.
Callers in Python pass values.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
from cyclopts import Parameter, Token

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError

FORMATS = ("png", "pdf", "svg")
"""Endings of the files of figures in results folders."""

MOST_PROCESSES = 4096
"""Of one machine; a larger number is a mistake."""

LARGEST_SEED, MOST_SEEDS = 2**31 - 1, 100_000
"""Of a command line."""


def words(
    parse: Callable[[str], Any], accepted: str, metavar: str, *, name: str | None = None,
    many: bool = False, completer: Callable[[Any], Any] | None = None,
) -> Parameter:  # fmt: skip
    """How an option's words become a value.

    Args:
        parse: Makes a value of one word; a ValueError refuses it.
        accepted: What is accepted, for the refusal.
        metavar: What the help shows in the place of the word.
        name: The option, such as --out; None: the argument's name.
        many: True if the option may be repeated, and the value is a list; the type is one, too.
        completer: Gives words for completion.
    """

    def value(token: Token) -> Any:
        try:
            return parse(token.value)
        except ValueError:
            option = token.keyword or metavar
            raise CdprError(f"{option}: found {token.value!r}; accepted: {accepted}") from None

    def convert(_kind: Any, tokens: Sequence[Token]) -> Any:
        return [value(token) for token in tokens] if many else value(tokens[-1])

    convert.many = many  # type: ignore[attr-defined]
    return Parameter(
        name=name, converter=convert, n_tokens=1, metavar=metavar, completer=completer,
        accepts_keys=False, json_list=False, json_dict=False, negative=(),
    )  # fmt: skip


def numbers(*sizes: int, by: str = ",") -> Callable[[str], Array]:
    """Makes finite numbers of words with a separator, as many as one of `sizes`; none: any."""

    def parse(word: str) -> Array:
        found = np.array([float(part) for part in word.split(by)])
        if (sizes and len(found) not in sizes) or not np.all(np.isfinite(found)):
            raise ValueError(word)
        return found

    return parse


def pose(word: str) -> Any:
    """X_WP of x,y,z [m] or x,y,z,phi,theta,psi [m, deg]."""
    from cdpr_drake.geometry.poses import pose_from_angles

    found = numbers(3, 6)(word)
    return pose_from_angles(found[:3], np.radians(found[3:] if len(found) == 6 else np.zeros(3)))


def box(word: str) -> tuple[Array, Array]:
    """Lower and upper corner, shape (3,) each, of x0:x1,y0:y1,z0:z1."""
    spans = np.array([numbers(2, by=":")(part) for part in word.split(",")])
    if spans.shape != (3, 2) or np.any(spans[:, 0] >= spans[:, 1]) or np.any(abs(spans) > 1e6):
        raise ValueError(word)
    return spans[:, 0], spans[:, 1]


def whole_pair(word: str) -> tuple[int, int]:
    """Two whole numbers, not negative, of a word such as 9x7."""
    first, second = word.lower().split("x")
    if not (first.strip().isdigit() and second.strip().isdigit()):
        raise ValueError(word)
    return int(first), int(second)


def names(word: str) -> list[str]:
    """Names with commas between."""
    return [part.strip() for part in word.split(",")]


def some_names(word: str) -> list[str]:
    """Names with commas between, or none."""
    return [] if word.strip() == "none" else names(word)


DEFAULT_FORMATS = ("png",)
"""Of figures in files."""


def formats(word: str) -> list[str]:
    """Endings of files, each once."""
    found = list(dict.fromkeys(names(word.lower())))
    if not set(found) <= set(FORMATS):
        raise ValueError(word)
    return found


def workers(word: str) -> int | str:
    """A number of processes, or what names a scheduler."""
    if not word:
        raise ValueError(word)
    try:
        count = int(word)
    except ValueError:
        return word
    if not 1 <= count <= MOST_PROCESSES:
        raise ValueError(word)
    return count


def seeds(word: str) -> list[int]:
    """Seeds of 0:20, where 20 is not included, or of 3,5,8, each once."""
    span = re.fullmatch(r"(\d{1,10}):(\d{1,10})", word)
    if span and int(span[2]) - int(span[1]) <= MOST_SEEDS:
        result = list(range(int(span[1]), int(span[2])))
    elif re.fullmatch(r"\d{1,10}(,\d{1,10})*", word):
        result = [int(part) for part in word.split(",")]
    else:
        result = []
    if not result or len(set(result)) < len(result) or max(result) > LARGEST_SEED:
        raise ValueError(word)
    return result


def named_numbers(word: str) -> tuple[str, Array]:
    """A name and numbers, of name=value or name=v1,v2."""
    name, mark, values = word.partition("=")
    if not (mark and name.strip()):
        raise ValueError(word)
    return name.strip(), numbers()(values)


def _files(kind: str) -> Callable[[Any], list[str]]:
    """Completes names of files of a kind that come with the package."""
    folder = Path(__file__).resolve().parents[2]

    def complete(_context: Any) -> list[str]:
        if kind == "scenario":
            return sorted(path.stem for path in (folder / "systems" / "scenarios").glob("*.yaml"))
        kinds = ("robot", "mechanism") if kind == "either" else (kind,)
        found = (folder / "models" / "robots").glob("*/*.yaml")
        return sorted(path.parent.name for path in found if path.stem in kinds)

    return complete


def _named(kind: str, metavar: str) -> Parameter:
    return words(str, f"a {metavar.lower()} by name or file", metavar, completer=_files(kind))


RobotWord: TypeAlias = Annotated[Any, _named("robot", "ROBOT")]
"""A robot by name or file; in Python a `Robot`, too."""

ModelWord: TypeAlias = Annotated[Any, _named("either", "ROBOT")]
"""A robot or a mechanism by name or file; in Python a `Robot` or `Mechanism`, too."""

ScenarioWord: TypeAlias = Annotated[Any, _named("scenario", "SCENARIO")]
"""A scenario by name or file."""

PoseWord: TypeAlias = Annotated[
    Any,
    words(pose, "x,y,z [m] or x,y,z,phi,theta,psi [m, deg]", "X,Y,Z[,PHI,THETA,PSI]"),
]
"""A pose; in Python whatever `as_pose` takes."""

Wrench: TypeAlias = Annotated[
    Sequence[float] | Array | None,
    words(numbers(6), "mx,my,mz,fx,fy,fz [N m, N]", "MX,MY,MZ,FX,FY,FZ"),
]
Vector: TypeAlias = Annotated[
    Sequence[float] | Array | None, words(numbers(3), "three numbers with commas", "X,Y,Z")
]
Numbers: TypeAlias = Annotated[
    Sequence[float] | Array | None, words(numbers(), "numbers with commas", "NUMBER,...")
]
Limits: TypeAlias = Annotated[
    tuple[float, float] | None, words(lambda word: tuple(numbers(2)(word)), "lower,upper [N]",
                                      "LOWER,UPPER"),
]  # fmt: skip
Box: TypeAlias = Annotated[
    tuple[Array, Array] | None,
    words(box, "lower:upper along x, y and z [m], as in -0.4:0.4,-0.4:0.4,0:1; no number beyond "
          "1e+06", "X0:X1,Y0:Y1,Z0:Z1"),
]  # fmt: skip
Names: TypeAlias = Annotated[Sequence[str], words(names, "names with commas", "NAME,...")]
SomeNames: TypeAlias = Annotated[
    Sequence[str] | None, words(some_names, "names with commas, or none", "NAME,...|none")
]
Joints: TypeAlias = Annotated[
    list[tuple[str, Any]] | Mapping[str, Any] | None,
    words(named_numbers, "name=value, or name=v1,v2 [rad, m]", "NAME=VALUE", name="--joint",
          many=True),
]  # fmt: skip
OutFolder: TypeAlias = Annotated[
    Path | None, words(Path, "the path of a folder", "FOLDER", name="--out")
]
Formats: TypeAlias = Annotated[
    Sequence[str],
    words(formats, "png, pdf, svg, or several with commas", "FORMAT,...", name="--figure-format",
          completer=lambda _: list(FORMATS)),
]  # fmt: skip
Workers: TypeAlias = Annotated[
    int | str | None,
    words(workers, f"1 to {MOST_PROCESSES} processes, or a Dask scheduler, tcp://host:port or its "
          "file", "COUNT|SCHEDULER"),
]  # fmt: skip
Seeds: TypeAlias = Annotated[
    Sequence[int],
    words(seeds, "first:end, as 0:20 for 0 to 19, or different seeds separated by commas, up to "
          f"{LARGEST_SEED} and {MOST_SEEDS} of them", "FIRST:END|SEED,..."),
]  # fmt: skip
Overrides: TypeAlias = Annotated[
    Sequence[str], words(str, "key=value", "KEY=VALUE", name="--set", many=True)
]


def one_of(known: Mapping[str, Any] | Sequence[str], name: str | None = None) -> Parameter:
    """One of some names, as METHODS of a room; `name` is the option's, if not the argument's."""
    return Parameter(name=name, choices=tuple(known))


def is_number(value: object) -> bool:
    """False for a float that is no number or not finite, as nan and inf on a command line."""
    return not isinstance(value, float) or math.isfinite(value)


OF_MECHANISMS = "found with a robot with one platform; accepted: with a mechanism"
OF_ROBOTS = "found with a mechanism; accepted: with a robot with one platform"
"""Refusals of arguments that say nothing about this kind of `ModelWord`."""


def refuse_arguments(why: str, **arguments: object) -> None:
    """Refuses arguments that have a value.

    Raises:
        CdprError: One has a value; names it, and says why.
    """
    names = ", ".join(name for name, value in arguments.items() if value is not None)
    if names:
        raise CdprError(f"{names}: {why}")


def _in_range(
    kind: Callable[[str], Any], low: float, high: float | None, what: str, metavar: str,
    name: str | None = None,
) -> Parameter:  # fmt: skip
    def parse(word: str) -> Any:
        value = kind(word)
        if not low <= value <= (math.inf if high is None else high) or not math.isfinite(value):
            raise ValueError(word)
        return value

    limits = f"at least {low:g}" if high is None else f"from {low:g} to {high:g}"
    return words(parse, f"{what}, {limits}", metavar, name=name)


def whole(
    low: int, high: int | None = None, metavar: str = "NUMBER", name: str | None = None
) -> Parameter:
    """A whole number, not below `low` and not above `high`."""
    return _in_range(int, low, high, "a whole number", metavar, name)


def number(low: float, high: float | None = None, metavar: str = "NUMBER") -> Parameter:
    """A number, not below `low` and not above `high`."""
    return _in_range(float, low, high, "a number", metavar)


def named_values(
    known: Sequence[str] | None = None, name: str | None = None, metavar: str = "NAME=VALUE,..."
) -> Parameter:
    """Numbers above 0 by name, of name=number with commas; shares may be 0.

    Args:
        known: Accepted names; None: any.
        name: The option.
        metavar: What the help shows in the place of the words.
    """

    def parse(word: str) -> dict[str, float]:
        return dict(map(pair, word.split(",")))

    def pair(item: str) -> tuple[str, float]:
        key, mark, value = item.strip().partition("=")
        amount = float(value) if mark else math.nan
        low = amount >= 0.0 if key.endswith("_share") else amount > 0.0
        if not (low and amount < 1e30) or (known is not None and key not in known):
            raise ValueError(item)
        return key, amount

    accepted = "name=number above 0, or several with commas"
    if known is not None:
        accepted += f"; names: {', '.join(known)}"
    return words(parse, accepted, metavar, name=name)


def comma_words(name: str | None = None) -> Parameter:
    """Words with commas between, none of them empty."""

    def parse(word: str) -> tuple[str, ...]:
        return tuple(part for part in names(word) if part)

    return words(parse, "words with commas", "NAME,...", name=name)


NewFolder: TypeAlias = Annotated[Path, words(Path, "the path of a folder", "FOLDER", name="--out")]
"""Where files are written; by default the working folder."""

Host: TypeAlias = Annotated[
    str | None, words(str, "a name or an address of this machine", "ADDRESS", name="--host")
]
Port: TypeAlias = Annotated[int | None, whole(1, 65535, "PORT")]
RunsFrom: TypeAlias = Annotated[
    Path | None, words(Path, "the path of a folder", "FOLDER", name="--runs-from")
]

OpenedWord: TypeAlias = Annotated[
    Any,
    words(str, "a robot, a scenario or a file", "ROBOT|SCENARIO|FILE",
          completer=lambda context: _files("robot")(context) + _files("scenario")(context)),
]  # fmt: skip
"""What the studio opens."""


class Word(str):
    """A word of a command line with its value, for results that tell what was asked.

    Attributes:
        value: What it means.
    """

    value: Any


def with_word(parse: Callable[[str], Any]) -> Callable[[str], Word]:
    """Makes a `Word` of a word that `parse` accepts."""

    def keep(word: str) -> Word:
        result = Word(word)
        result.value = parse(word)
        return result

    return keep


def value_of(given: Any) -> Any:
    """The value of a `Word`; of anything else, itself."""
    return given.value if isinstance(given, Word) else given


def poses(word: str) -> list[Any]:
    """Poses X_WP with ; between them."""
    return [pose(part) for part in word.split(";") if part.strip()]


Switch: TypeAlias = Annotated[bool, Parameter(negative=())]
"""An option without a value, which is off by default."""

InputFile: TypeAlias = Annotated[Any, words(Path, "the path of a file", "FILE")]
"""A file; in Python what it holds, too."""
