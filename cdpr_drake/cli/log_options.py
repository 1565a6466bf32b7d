"""Options of commands that read logs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from cdpr_drake.analyses.frame.words import one_of, words
from cdpr_drake.analyses.logs.log_formats import AUTO, LOG_READERS
from cdpr_drake.analyses.logs.log_request import (
    LogRequest,
    axes_rotation,
    checked_units,
    is_rate,
    read_mapping,
)
from cdpr_drake.errors import CdprError


def _units(word: str) -> dict[str, str]:
    pairs = [item.strip().partition("=") for item in word.split(",")]
    if not all(mark for _, mark, _ in pairs):
        raise ValueError(word)
    return checked_units({dimension: unit for dimension, _, unit in pairs})


def _rate(word: str) -> float:
    rate = float(word)
    if not is_rate(rate):
        raise ValueError(word)
    return rate


LogFormat: TypeAlias = Annotated[str, one_of((*LOG_READERS, AUTO))]
Units: TypeAlias = Annotated[
    dict[str, str] | None,
    words(_units, "DIMENSION=UNIT, as length=mm, or several with commas", "DIMENSION=UNIT,...",
          name="--unit"),
]  # fmt: skip
Mapping: TypeAlias = Annotated[Path | None, words(Path, "the path of a YAML file", "FILE")]
Rate: TypeAlias = Annotated[float | None, words(_rate, "above 0 [1/s]", "RATE")]
Axes: TypeAlias = Annotated[Any, words(axes_rotation, "three axes, as -z,-x,y", "AXIS,AXIS,AXIS")]


def log_request(
    cables: Sequence[str] | None = None, *, unit: dict[str, str] | None, mapping: Path | None,
    rate: float | None, body: str | None, axes: Any,
) -> LogRequest:  # fmt: skip
    """What options say of a log.

    Raises:
        CdprError: Names of cables are empty or the same.
    """
    if cables is not None and (not all(cables) or len(set(cables)) < len(cables)):
        raise CdprError(
            f"cables: found {', '.join(cables)!r}; accepted: different names, as A,B,C,D"
        )
    return LogRequest(
        cables=None if cables is None else tuple(cables), units=unit or {}, body=body, rate=rate,
        mapping=None if mapping is None else read_mapping(mapping), R_WF=axes,
    )  # fmt: skip
