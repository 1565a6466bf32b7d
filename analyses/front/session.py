"""Who follows a fit while it goes on."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

from cdpr_drake.analyses.reporting.output_folder import ResultsFolder

_LOG = logging.getLogger(__name__)

Say = Callable[[str], None]
"""Told what is done now."""


class Session:
    """Who follows a fit; results do not depend on it.

    The commands derive theirs, which write lines.
    """

    def __init__(self, say: Say | None = None) -> None:
        """With what gets a line on what is done; None: the logger "cdpr_drake", as INFO."""
        self._say = say

    def say(self, words: str) -> None:
        """Takes a line on what is done."""
        if self._say is None:
            _LOG.info("%s", words)
        else:
            self._say(words)

    def opened(self, results: ResultsFolder) -> None:
        """Takes the results folder when it is there, before anything is computed."""

    def doing(self, words: str) -> AbstractContextManager[Say]:
        """What is entered around work, with words for it; gives what changes the words."""
        self.say(words)
        return nullcontext(self.say)
