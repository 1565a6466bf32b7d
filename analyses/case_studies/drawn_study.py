"""How a study is written: its numbers, then the figures that can be drawn of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from cdpr_drake.analyses.pictures import DEFAULT_FORMATS, write_figures
from cdpr_drake.analyses.reporting import write_json


class DrawnStudy(ABC):
    """What a study found that can be told and drawn."""

    @abstractmethod
    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON."""

    @abstractmethod
    def drawings(self) -> Mapping[str, Callable[[], Figure]]:
        """What draws the figures that what is finished suffices for, by name; what finds only when
        it draws that data is missing raises NothingToDraw."""

    def write(self, folder: Path, formats: Sequence[str] = DEFAULT_FORMATS) -> dict[str, str]:
        """Writes `results.json`, then the figures, into a folder that exists.

        Returns:
            Of each figure that could not be written, the file and why, in one line.
        """
        write_json(folder / "results.json", self.as_dict())
        return write_figures(folder, self.drawings(), formats)
