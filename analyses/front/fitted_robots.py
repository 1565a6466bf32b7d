"""What fits to logs give alike: a robot, numbers, tables, figures, and where they are kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from rich.table import Table

from cdpr_drake.analyses.calibration.log_fit import LogFit
from cdpr_drake.analyses.frame.figures import write_figures
from cdpr_drake.analyses.frame.words import DEFAULT_FORMATS
from cdpr_drake.analyses.front.session import Say, Session
from cdpr_drake.analyses.reporting.deferred_figures import drawing
from cdpr_drake.analyses.reporting.output_folder import results_folder
from cdpr_drake.errors import CdprError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.summaries import Summarized

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FittedRobot(Summarized):
    """What a fit of a robot to logs tells.

    Attributes:
        fit: The robot that was found, numbers, tables and figures.
        folder: Where they were written; None: nowhere.
        failed: Of each figure that could not be written, the file and why.
    """

    fit: LogFit
    folder: Path | None = None
    failed: Mapping[str, str] = field(default_factory=dict)

    @property
    def fits(self) -> bool:
        """Whether what was found fits what was measured."""
        return self.fit.fits

    def as_dict(self) -> dict[str, Any]:
        """For JSON, as the command prints it."""
        return self.fit.numbers

    def robot(self) -> Robot:
        """The robot that was found."""
        return self.fit.robot

    def tables(self) -> Sequence[Table]:
        """Tables for the terminal."""
        return self.fit.tables

    def plot(self, name: str | None = None) -> Figure:
        """A figure.

        Args:
            name: Its name; None: the first.

        Raises:
            CdprError: There is no such figure.
        """
        drawings = self.fit.drawings
        if name is not None and name not in drawings:
            raise CdprError(f"name: {name!r} is unknown; {closest(name, drawings)}")
        return drawings[next(iter(drawings)) if name is None else name]()


Fitted = TypeVar("Fitted", bound=FittedRobot)


class Keeping(NamedTuple):
    """Where a fit is written; None: nowhere. And whether over other results, in which formats."""

    folder: Path | str | None = None
    overwrite: bool = False
    formats: Sequence[str] = DEFAULT_FORMATS


def kept_fit(
    keeping: Keeping, session: Session, title: str, work: Callable[[Path | None, Say], Fitted]
) -> Fitted:
    """A fit, written where it is to be kept.

    Figures come last, when the results have their place: one that cannot be written costs nothing
    else, and what ends while they are drawn is made again by the same call.

    Args:
        keeping: Where to.
        session: Who follows it.
        title: What is done, for who follows it.
        work: Fits, and writes all but figures into the folder that it gets.

    Raises:
        OutputFolderError: The folder cannot be written, or holds other results.
    """
    if keeping.folder is None:
        with session.doing(title) as say:
            return work(None, say)
    with (
        results_folder(Path(keeping.folder), keeping.overwrite, redo=True) as results,
        session.doing(title) as say,
    ):
        session.opened(results)
        found = work(results.path, say)
        folder = results.publish()
        say("figures")
        with drawing(folder):
            failed = write_figures(folder, found.fit.drawings, keeping.formats)
    return replace(found, folder=folder, failed=failed)
