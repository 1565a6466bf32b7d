"""What commands show whose verbs give no `Result`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.frame.result import Result, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
