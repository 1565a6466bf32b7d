"""Errors as messages in the page: whatever a handler raises, the server stays alive."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui

from cdpr_drake.errors import CdprError

LONGEST = 490
"""Characters of a message; longer ones lose their middle."""

_LOG = logging.getLogger(__name__)


def message(problem: BaseException) -> str:
    """What a problem says, for people, at most `LONGEST` characters a line."""
    if isinstance(problem, CdprError):
        words = str(problem)
    elif isinstance(problem, OSError):
        where = f"{problem.filename}: " if problem.filename else ""
        words = f"{where}{problem.strerror or problem}"
    else:
        words = f"{type(problem).__name__}: {' '.join(str(problem).split()) or 'nothing is known'}"
    lines = ["".join(c if c.isprintable() else repr(c)[1:-1] for c in x) for x in words.split("\n")]
    return "\n".join(
        line if len(line) <= LONGEST else f"{line[: LONGEST * 3 // 4]} ... {line[-LONGEST // 5 :]}"
        for line in lines
    )


def shown(words: str, kind: str = "negative", *, stays: bool = False) -> None:
    """Shows words over the page; `kind` is positive, negative, warning or info.

    What is wrong, and what `stays`, is there until it is closed, all else for four seconds.
    """
    ui.notify(
        words,
        type=kind,  # type: ignore[arg-type]
        multi_line=True,
        close_button="Close",
        timeout=0 if stays or kind == "negative" else 4000,
        classes="studio-notice",
    )


@contextmanager
def quietly() -> Iterator[None]:
    """Shows what the block raises as a message in the page, and goes on.

    Mistakes of this program are shown, too, and logged with their traceback.
    """
    try:
        yield
    except Exception as problem:
        if not isinstance(problem, (CdprError, OSError)):
            _LOG.exception("in a handler of the studio's page")
        shown(message(problem))
