"""What the Tab key offers: subcommands and names at once, options as soon as they are imported.

Where the shell asks for the word after a subcommand, names come from the names of files: Drake is
not imported for them.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Annotated

import typer

PROGRAM = "cdpr"

_PACKAGE = Path(__file__).parent.parent

Complete = Callable[[str], list[str]]
"""Words that begin as what was typed, which is its argument."""


def robot_words(incomplete: str) -> list[str]:
    """Robots that come with the package."""
    found = (_PACKAGE / "models" / "robots").glob("*/robot.yaml")
    return _beginning(incomplete, [path.parent.name for path in found])


def robot_or_mechanism_words(incomplete: str) -> list[str]:
    """Robots and mechanisms that come with the package."""
    found = (_PACKAGE / "models" / "robots").glob("*/mechanism.yaml")
    mechanisms = _beginning(incomplete, [path.parent.name for path in found])
    return sorted(robot_words(incomplete) + mechanisms)


def scenario_words(incomplete: str) -> list[str]:
    """Scenarios that come with the package."""
    found = (_PACKAGE / "systems" / "scenarios").glob("*.yaml")
    return _beginning(incomplete, [path.stem for path in found])


def studio_words(incomplete: str) -> list[str]:
    """Robots and scenarios that come with the package."""
    return sorted(robot_words(incomplete) + scenario_words(incomplete))


def words_among(names: Collection[str]) -> Complete:
    """What completes one of some names; a table counts with what it has later."""
    return lambda incomplete: _beginning(incomplete, names)


def _beginning(incomplete: str, names: Collection[str]) -> list[str]:
    return sorted(name for name in names if name.startswith(incomplete))


FIRST_ARGUMENT: dict[str, Complete] = {
    "simulate": scenario_words,
    "serve": scenario_words,
    "tension": robot_or_mechanism_words,
    "static": robot_or_mechanism_words,
    "equilibria": robot_words,
    "design": robot_words,
    "plan": robot_words,
    "reconfigure": robot_words,
    "view": robot_or_mechanism_words,
    "studio": studio_words,
    "export": robot_words,
    "calibrate": robot_words,
    "identify": robot_words,
}
"""By subcommand: what completes the word after it."""


def asked_words() -> list[str] | None:
    """The words after `cdpr` of which the shell wants the last one completed, else None."""
    shell = os.environ.get(f"_{PROGRAM.upper()}_COMPLETE", "").removeprefix("complete_")
    if shell == "bash":
        words = _split(os.environ.get("COMP_WORDS", ""))
        last = int(os.environ.get("COMP_CWORD", "0"))
        return [*words[1:last], words[last] if last < len(words) else ""]
    typed = os.environ.get("_TYPER_COMPLETE_ARGS")
    if not shell or typed is None:
        return None
    return _split(typed)[1:] + ([""] if typed.endswith(" ") else [])


def _split(line: str) -> list[str]:
    try:
        return shlex.split(line)
    except ValueError:  # a quote that is still open
        return line.split()


def stand_in(name: str) -> Callable[..., None] | None:
    """In the place of a subcommand of which only the first argument is to be completed."""
    words = asked_words()
    if words is None or words[:-1] != [name] or words[-1].startswith("-"):
        return None
    if name not in FIRST_ARGUMENT:
        return None

    def of_names(word: str) -> None:
        """Never runs."""

    argument = typer.Argument(autocompletion=FIRST_ARGUMENT[name])
    of_names.__annotations__ = {"word": Annotated[str, argument]}  # typer evaluates no local name
    return of_names
