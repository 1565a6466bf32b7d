"""Two logs of one motion as one: the second one's clock read as the first one's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cdpr_drake.analyses.logs.recorded_log import (
    ESTIMATED,
    LENGTH,
    MOTOR,
    POSITION,
    QUATERNION,
    TIME,
    RecordedLog,
)
from cdpr_drake.analyses.reporting.exported_logs import Columns
from cdpr_drake.arrays import Array
from cdpr_drake.errors import LogFileError
from cdpr_drake.numerics.clock_alignment import ClockAlignment, align_clocks, interpolate_rows


@dataclass(frozen=True, eq=False)
class JoinedLogs:
    """Two logs as one.

    Attributes:
        log: Rows of the first one, with the second one's columns between its samples.
        alignment: How its clock was read.
        by: Columns of both by which that was found.
        compared: Columns of the first one that were explained by the second one's, shape (k, n).
    """

    log: RecordedLog
    alignment: ClockAlignment
    by: tuple[tuple[str, ...], tuple[str, ...]]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        found, (shift, drift) = self.alignment, self.alignment.sigmas
        return {
            "shift_s": found.shift,
            "shift_sigma_s": shift,
            "drift": found.drift,
            "drift_sigma": drift,
            "reference_s": found.reference,
            "by": [list(headers) for headers in self.by],
            "residual_rms": dict(zip(self.by[0], found.residual.tolist(), strict=True)),
            "rows": found.rows,
        }

    def words(self) -> str:
        """In one line."""
        found, (shift, drift) = self.alignment, self.alignment.sigmas
        return (
            f"the second clock is read {found.shift:+.5f} s later, sigma {1e3 * shift:.3f} ms, at "
            f"{found.reference:.4g} s of its own; drift {1e6 * found.drift:+.1f} ppm, sigma "
            f"{1e6 * drift:.1f} ppm"
        )


def join_logs(first: RecordedLog, second: RecordedLog) -> JoinedLogs:
    """Reads the second log's clock as the first one's, and puts both into one.

    The clocks are told by what moved in both: positions, cable lengths, motor angles, or positions
    that a controller estimated, whichever a log has first.

    Raises:
        LogFileError: One has no times or nothing that moved, or both have a column.
        ClockError: They are not of one motion, or it repeats itself.
    """
    if first.time is None or second.time is None:
        path = first.path if first.time is None else second.path
        raise LogFileError(
            f"{path}: time: found no column of times; accepted: one, to align two clocks"
        )
    both = [h for h in second.columns if h in first.columns and h != TIME]
    if both:
        raise LogFileError(
            f"{second.path}: found {', '.join(both[:4])}, which {first.path} has, too; accepted: "
            "each column in one of the two logs"
        )
    by_first, by_second = _moving(first, LENGTH), _moving(second, POSITION[0])
    alignment = align_clocks(
        first.time, first.table(by_first), second.time, second.table(by_second)
    )
    at = alignment.on_other_clock(first.time)
    names = tuple(h for h in second.columns if h != TIME)
    table = interpolate_rows(second.time, _one_sign(second, names), at)
    found: Columns = dict(first.columns) | dict(zip(names, table.T, strict=True))
    if all(name in found for name in QUATERNION):
        size = np.linalg.norm([found[name] for name in QUATERNION], axis=0)
        size = np.where(found[QUATERNION[0]] < 0.0, -size, size)
        found |= {name: found[name] / size for name in QUATERNION}
    missing = int(np.count_nonzero(np.isnan(table).all(axis=1)))
    joined = JoinedLogs(
        replace(
            first,
            format=f"{first.format} and {second.format}",
            why=f"{first.why}; {second.path.name}: {second.why}",
            columns=found,
            units={**first.units, **{f"{second.path.name}, {k}": v for k, v in
                                     second.units.items()}},
            remarks=(*first.remarks, *(f"{second.path.name}: {r}" for r in second.remarks)),
        ),
        alignment,
        (by_first, by_second),
    )  # fmt: skip
    said = [joined.words()]
    if missing:
        said.append(f"{missing} rows of the first log have nothing of the second beside them")
    return replace(joined, log=replace(joined.log, remarks=(*joined.log.remarks, *said)))


def _one_sign(log: RecordedLog, names: tuple[str, ...]) -> Array:
    """Columns to interpolate: quaternions go on without a change of sign."""
    table = np.array(log.table(names))
    if all(name in names for name in QUATERNION):
        columns = [names.index(name) for name in QUATERNION]
        q = table[:, columns]
        rows = np.flatnonzero(np.isfinite(q).all(axis=1))
        turned = np.sum(q[rows[1:]] * q[rows[:-1]], axis=1) < 0.0
        sign = np.cumprod(np.where(np.concatenate([[False], turned]), -1.0, 1.0))
        for k, column in enumerate(columns):
            table[rows, column] = q[rows, k] * sign
    return table


def _moving(log: RecordedLog, best: str) -> tuple[str, ...]:
    """Columns by which a log's clock is told."""
    points = tuple(h for h in POSITION if h in log.columns)
    guessed = tuple(f"{ESTIMATED}{h}" for h in POSITION if f"{ESTIMATED}{h}" in log.columns)
    lengths, motors = tuple(log.of_cables(LENGTH)), tuple(log.of_cables(MOTOR))
    kinds = [points, lengths, motors, guessed] if best != LENGTH else [
        lengths, motors, points, guessed
    ]  # fmt: skip
    found = next((kind for kind in kinds if kind), ())
    if not found:
        raise LogFileError(
            f"{log.path}: found no positions, lengths or motor angles; accepted: one of them, to "
            "align two clocks"
        )
    return found
