"""Fits as `Follow` and `Result` have it, until their verbs do that themselves."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.frame.folder import shown_path
from cdpr_drake.analyses.frame.follow import Follow, Progress
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.front.session import Session
from cdpr_drake.analyses.reporting.output_folder import ResultsFolder
from cdpr_drake.cli.terminal import message_console
from cdpr_drake.errors import CdprError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NAMED = 3
"""So many files that were kept are named."""


class FollowedSession(Session):
    """Tells who follows a command what a fit does, and which files were kept."""

    def __init__(self, follow: Follow) -> None:
        """Of one call."""
        super().__init__()
        self.follow = follow
        self._results: ResultsFolder | None = None

    def say(self, words: str) -> None:
        """Says a line."""
        self.follow.say(words)

    def opened(self, results: ResultsFolder) -> None:
        """Says where results of killed commands went that nobody has seen yet."""
        self._results = results
        for folder in results.recovered:
            where = shown_path(folder)
            self.say(f"Found finished results of a command that was killed; they are in {where}")

    def kept(self) -> list[str]:
        """Which files of others were kept when results were replaced, and where."""
        if self._results is None:
            return []
        lines = []
        for names, folder in self._results.kept:
            more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
            lines.append(
                f"Kept in {shown_path(folder)}: {', '.join(names[:NAMED])}{more}: not written by "
                "cdpr as far as is known, or changed since"
            )
        return lines

    @contextmanager
    def doing(self, words: str) -> Iterator[Callable[[str], None]]:
        """Tells what is done."""

        def tell(what: str) -> None:
            self.follow.progress(Progress(what, 0.0, 0.0))

        tell(words)
        yield tell


def fit_session() -> FollowedSession:
    """Of a fit, which Ctrl-C ends at once: nothing is finished and kept."""
    return FollowedSession(Follow(say=message_console().print))


@dataclass(frozen=True, repr=False, kw_only=True)
class Answer(Result):
    """What a command shows of a result that is no `Result` itself.

    Attributes:
        numbers: For JSON.
        printed: Tables of rich, and words.
        words: Sentences on what was missing or stopped.
        code: Exit code.
        failed: Of each file that could not be written, its path and why.
        drawing: Draws it, if it can be drawn.
    """

    numbers: Any
    printed: Sequence[Any] = ()
    words: Sequence[str] = ()
    code: int = 0
    failed: Mapping[str, str] = field(default_factory=dict)
    drawing: Callable[[], Figure] | None = None

    def as_dict(self) -> Any:
        """For JSON."""
        return self.numbers

    def tables(self) -> Sequence[Table]:
        """None that are made of words."""
        return ()

    def lines(self) -> Sequence[str]:
        """Words among what is printed."""
        return [item for item in self.printed if isinstance(item, str)]

    def notes(self) -> Sequence[str]:
        """On what was missing or stopped."""
        return self.words

    def figures(self) -> Mapping[str, Callable[[], Figure]]:
        """What draws it."""
        return {} if self.drawing is None else {"result": self.drawing}

    @property
    def exit_code(self) -> int:
        """As the command has it."""
        return self.code

    def show(self, console: Any) -> None:
        """Prints tables and words in their order."""
        for item in self.printed:
            console.print(item, soft_wrap=isinstance(item, str), highlight=False)


def failures(failed: Mapping[str, str], folder: Path | None) -> dict[str, str]:
    """Paths of files that could not be written, and why."""
    return {str(name if folder is None else folder / name): why for name, why in failed.items()}


def refuse(
    verb: Callable[..., Any], values: Mapping[str, Any], beside: str, *,
    names: Iterable[str] | None = None, accepted: Iterable[str] = (),
) -> None:  # fmt: skip
    """Refuses arguments that say nothing beside others.

    Args:
        verb: Whose arguments they are.
        values: Of all its arguments, by name.
        beside: Ends the refusal: beside what they were found, and what is accepted.
        names: Those that are refused; None: all but `accepted`.
        accepted: Those that are not.

    Raises:
        CdprError: One of them is not what the verb has by itself.
    """
    parameters = inspect.signature(verb).parameters
    refused = [
        name for name, parameter in parameters.items()
        if (name in names if names is not None else name not in (*accepted, "follow"))
        and not _same(values[name], parameter.default)
    ]  # fmt: skip
    refused.sort(key=lambda name: parameters[name].kind is inspect.Parameter.POSITIONAL_ONLY)
    if refused:
        raise CdprError(f"{', '.join(refused)}: found {beside}")


def _same(value: Any, default: Any) -> bool:
    return value is default or (isinstance(value, str | int | float) and value == default)
