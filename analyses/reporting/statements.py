"""What a source states, beside what a study found, and how the tables of studies look."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TypeVar

from rich.box import SIMPLE_HEAD
from rich.table import Table

CONFIRMED = "confirmed"
IN_PART = "in part"
NOT_CONFIRMED = "not confirmed"
NOT_TESTABLE = "not testable"
"""The study could not have found otherwise, or looks at nothing that the statement is about."""
NOT_JUDGED = "not judged"
"""Checking what was found ended in an error."""
NOT_IN_QUICK = "not judged in the quick form"
"""The runs that it needs are those of the full form."""

StudyData = TypeVar("StudyData")
Said = TypeVar("Said")


@dataclass(frozen=True)
class Statement:
    """One statement of a source.

    Attributes:
        words: What it says.
        printed: Its numbers.
        found: The study's.
        verdict: CONFIRMED, IN_PART, NOT_CONFIRMED, NOT_TESTABLE, NOT_JUDGED or NOT_IN_QUICK.
        why: What is known of the difference; may be empty.
        name: That of its check, by which tables of what was published find it; see
            `name_of_check`.
    """

    words: str
    printed: str
    found: str
    verdict: str
    why: str = ""
    name: str = ""

    def as_dict(self) -> dict[str, str]:
        """For JSON."""
        return asdict(self)


def verdict(every: bool, some: bool = False) -> str:
    """CONFIRMED where `every` part of a statement holds, IN_PART where `some` does."""
    return CONFIRMED if every else IN_PART if some else NOT_CONFIRMED


def failed_check(check: str, problem: Exception) -> Statement:
    """The statement of a check that failed: its name, and what went wrong."""
    words = (str(problem) or type(problem).__name__).splitlines()[0][:200]
    return Statement(f"({check})", "", f"judging failed: {words}", NOT_JUDGED)


def name_of_check(check: Callable[..., object]) -> str:
    """Name of a check: that of its function, without the underscore of what a module keeps."""
    return str(getattr(check, "__name__", type(check).__name__)).lstrip("_")


def topic_of_check(check: Callable[..., object]) -> str:
    """What a check looks at, in words: the first line of its docstring; its name without one."""
    lines = (check.__doc__ or "").strip().splitlines()
    return lines[0] if lines else name_of_check(check).replace("_", " ")


def names_of_checks(checks: Iterable[Callable[..., object]]) -> tuple[str, ...]:
    """Names of checks, see `name_of_check`."""
    return tuple(map(name_of_check, checks))


def evaluate_checks(
    checks: Iterable[Callable[[StudyData], Statement]], found: StudyData, quick: bool = False
) -> list[Statement]:
    """What checks say of what a study found, each statement with the name of its check.

    Args:
        checks: Each looks at it; one that misses something in it raises KeyError.
        found: What the study has so far.
        quick: Whether that was the quick form, where what a check misses is not coming: it is
            named then, as NOT_IN_QUICK, and otherwise left out.
    """
    statements = []
    for check in checks:
        name = name_of_check(check)
        said = run_checks([check], found, failed_check)
        if not said and quick:
            said = [Statement(topic_of_check(check), "", "", NOT_IN_QUICK)]
        statements += [replace(one, name=name) for one in said]
    return statements


def run_checks(
    checks: Iterable[Callable[[StudyData], Said]],
    found: StudyData,
    failed: Callable[[str, Exception], Said] | None = None,
) -> list[Said]:
    """What checks say of what was found.

    Args:
        checks: Each looks at it; one that misses something in it (KeyError) says nothing.
        found: What a study has so far.
        failed: What to say for a check, by its name, that ends in another error, so that one
            check does not cost what a study has computed. None: the error is raised.
    """
    statements = []
    for check in checks:
        try:
            statements.append(check(found))
        except KeyError:
            continue
        except Exception as problem:
            if failed is None:
                raise
            statements.append(failed(getattr(check, "__name__", "judge"), problem))
    return statements


def new_table(title: str, left: Sequence[str], right: Sequence[str]) -> Table:
    """An empty table with columns of words, then columns of numbers."""
    table = Table(
        title=title, title_justify="left", caption_justify="left", box=SIMPLE_HEAD, pad_edge=False
    )
    for heading in left:
        table.add_column(heading)
    for heading in right:
        table.add_column(heading, justify="right")
    return table


def statement_table(title: str, statements: Sequence[Statement], caption: str = "") -> Table:
    """What a source states, printed and found side by side."""
    table = new_table(title, ("statement", "printed", "found", "verdict", "why"), ())
    table.caption = caption or None
    for statement in statements:
        table.add_row(
            statement.words, statement.printed, statement.found, statement.verdict, statement.why
        )
        table.add_section()
    return table
