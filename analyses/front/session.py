"""Who follows a call of the front door while it goes on, and may stop it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from cdpr_drake.analyses.reporting.output_folder import ResultsFolder, continued_folder

if TYPE_CHECKING:  # workspaces and others that are followed need no simulation
    from cdpr_drake.analyses.simulation.scenario_kinds import ScenarioKind
    from cdpr_drake.analyses.visualization.live_view import Prepare
    from cdpr_drake.systems.remote.remote_place import Remote

_LOG = logging.getLogger(__name__)

Say = Callable[[str], None]
"""Told what is done now."""


class Outside(Protocol):
    """A process outside that closes the loop of a run."""

    def connect(self, remote: Remote) -> None:
        """Brings it to its place."""

    def tell_end(self, result: Any) -> None:
        """Tells it how the run ended."""


class Session:
    """Who follows a call and may stop it; results do not depend on it.

    What nobody is told goes to the logger "cdpr_drake", as INFO; warnings as WARNING, which Python
    prints on stderr unless the program configures logging.

    The commands derive theirs, which show bars and write lines.

    Attributes:
        watched: Whether Meshcat shows a run, which looks into a diagram.
        outside: What closes the loop of a run; None: the run itself.
    """

    watched = False
    outside: Outside | None = None

    def __init__(
        self,
        on_progress: Callable[[Any], None] | None = None,
        should_stop: Callable[[], bool] | None = None,
        say: Say | None = None,
    ) -> None:
        """With what is called.

        Args:
            on_progress: Told how far the call is: a `Progress` of one run, a `StudyOfMany` of a
                reproduction, else a `WorkProgress`.
            should_stop: Asked often; True ends the call early, with what it has.
            say: Told what is done now, and what should be known of it, a line each; None: the log.
        """
        self._on_progress, self._should_stop, self._say = on_progress, should_stop, say

    def progress(self, progress: Any) -> None:
        """Takes how far the call is, inside `computing`."""
        if self._on_progress is not None:
            self._on_progress(progress)

    def stop(self) -> bool:
        """Whether the call shall end early."""
        return self._should_stop is not None and self._should_stop()

    def say(self, words: str) -> None:
        """Takes a line on what is done."""
        if self._say is None:
            _LOG.info("%s", words)
        else:
            self._say(words)

    def warn(self, words: str) -> None:
        """Takes a line that should be read: what was asked may not be what was meant."""
        if self._say is None:
            _LOG.warning("%s", words)
        else:
            self._say(f"warning: {words}")

    def opened(self, results: ResultsFolder) -> None:
        """Takes the results folder when it is there, before anything is computed."""

    def computing(self, part: str = "") -> AbstractContextManager[object]:
        """What is entered around the computation; after the first around further parts, by name."""
        return nullcontext()

    def doing(self, words: str) -> AbstractContextManager[Say]:
        """What is entered around other work, with words for it; gives what changes the words."""
        self.say(words)
        return nullcontext(self.say)

    def prepare(self, kind: ScenarioKind, scenario: Any) -> Prepare | None:
        """What gets a run's simulator and diagram before it starts; None: nobody."""
        return None


@contextmanager
def kept_folder(folder: Path | str, session: Session) -> Iterator[Path]:
    """A folder that keeps what is finished, for nobody else inside the block.

    Raises:
        OutputFolderError: As `continued_folder`.
    """
    with continued_folder(Path(folder)) as results:
        session.opened(results)
        yield Path(folder)
