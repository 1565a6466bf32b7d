"""Options in the place of the arguments that messages of the library name."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from cdpr_drake.errors import CdprError

COMMAND_WORDS = {
    "cdpr_drake.models.load_robot": "a command that takes one, such as cdpr tension or cdpr view",
    "cdpr_drake.models.load_mechanism": "a command that takes one, such as cdpr static",
    "cdpr_drake.systems.load_scenario": "a command that takes one, such as cdpr simulate",
    "camera.kind=projected": "--camera projected",
    "plot": "--plot",
}  # fmt: skip
"""Commands and options in the place of functions and settings that messages name."""

BEFORE = ("add", "allow", "found", "leave out", "needs", "use", "with", "without")
"""Words of a message after which an argument is named."""


def with_options(message: str, options: Mapping[str, str]) -> str:
    """A message of the library as who uses a command reads it.

    Arguments are named where a line or, behind a file, its refusal begins with them, behind
    `BEFORE`, and, where they have an underscore, which no other word has, anywhere.

    Args:
        message: Of one or more lines.
        options: Options by the words for arguments.
    """
    if not options:
        return message
    return "\n".join(_line_with_options(line, options) for line in message.split("\n"))


def _line_with_options(line: str, options: Mapping[str, str]) -> str:
    if not options:
        return line
    known = "|".join(map(re.escape, sorted(options, key=len, reverse=True)))
    named = rf"(?:{known})(?=[:;,) ]|$)"
    head = re.match(rf"{named}(?:, {named})*", line)
    begin = "" if head is None else head[0]
    said = ", ".join(options[name] for name in begin.split(", ")) if begin else ""

    def option(place: re.Match[str]) -> str:
        before, name = place.groups()
        meant = before.strip(" (") or "_" in name or _is_refused(place)
        return before + (options[name] if meant else name)

    rest = rf"((?<![\w-])(?:{'|'.join(BEFORE)}) |[ (])({named})"
    return said + re.sub(rest, option, line[len(begin) :])


def _is_refused(place: re.Match[str]) -> bool:
    """Whether what stands there is what was found wrong, as in `log.csv: bandwidth: found 0 Hz`."""
    line = place.string
    return line.endswith(":", 0, place.start()) and line.startswith(": found", place.end())


@contextmanager
def named_options(options: Mapping[str, str]) -> Iterator[None]:
    """Says options where what is refused inside the block says Python's arguments.

    Args:
        options: Options by the words for arguments, as `with_options` takes them.
    """
    try:
        yield
    except CdprError as problem:
        problem.args = tuple(
            with_options(words, options) if isinstance(words, str) else words
            for words in problem.args
        )
        if hasattr(problem, "__notes__"):
            problem.__notes__ = [with_options(note, options) for note in problem.__notes__]
        raise
