"""Groups of a fit's measurements that disagree: sensors, kinds and rows, and what they need.

At a minimum the residuals over sigma are r = M e, with e the noise and M the projector off all that
parameters and poses can follow. A systematic error c d, such as all lengths of a cable being a
share c too long (d: minus these lengths over sigma, else 0), leaves c M d in them, so that

    c = d' r / d' M d,    t = d' r / sqrt(sum over kinds g of s_g^2 |(M d)_g|^2)

estimates it and tests it. s_g, the scatter of a kind of measurement over its stated sigma, is that
of the residuals themselves once c d is taken out: sigmas that are too large or too small by a
factor change no test, and an error does not hide behind the scatter that it makes. t has Student's
distribution, with degrees of freedom by Satterthwaite's rule.

An error makes a misfit where it is certain (`FALSE_ALARM` over the number of tests) and where it
moves poses by more than their stated deviations (`MATERIAL`). Rows that are off are sought among
all sets of rows: that of n rows of N has one of C(N, n) tests.

Errors that are large beside sigma are thrown out of the fit instead. The fit then rests on the
readings that remain, and it contradicts itself where a row has no more of these to check its pose
than it lost, or where a sensor or a kind lost more than single outliers explain.

Source: Lagrange-multiplier test of omitted variables: Cook and Weisberg, Residuals and influence in
regression, 1982, 2.2; Baarda, A testing procedure for use in geodetic networks, 1968, for tests of
gross errors behind a projector; Rao, Estimation of variance components, 1971, for s_g;
Satterthwaite, An approximate distribution of estimates of variance components, 1946; Wald and
Wolfowitz, On a test whether two samples are from the same population, 1940, for runs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import comb, gammaln
from scipy.stats import binom, hypergeom, norm, t

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import LeastSquares
from cdpr_drake.calibration.pose_search import OUTLIER
from cdpr_drake.calibration.projected_residuals import (
    END_ROWS,
    LEAST_SEEN,
    Flags,
    ProjectedResiduals,
    Rows,
)
from cdpr_drake.calibration.result import CalibrationResult
from cdpr_drake.calibration.stations import Point

FALSE_ALARM = 1e-4
"""Probability that noise alone makes a log a misfit; of 200 logs, 2 % have a false alarm. Each of n
tests has this over n (Bonferroni)."""

LIKELY = 1e-2
"""As `FALSE_ALARM`, of errors that are remarked."""

MOST_DROPPED = 0.1
"""Share of the readings of a sensor or a kind that may be thrown out."""

SINGLE_OUTLIERS = 0.02
"""Share that single outliers are expected to be."""

MOST_ROWS = 0.05
"""Share of rows, or one row, that may have lost a single reading of which none but itself tells."""

FEWEST_EXPLAINED = 2
"""Rows that one factor explains."""

LEFT_OVER, HALF, AGREEING = 0.1, 0.5, 0.2
"""Shares of the largest residual of a row that its factor leaves, since poses turn with it, and
where what it leaves is no outlier; and share by which factors of rows differ from their median."""

MATERIAL = 2.5
"""An error moves poses by more of their stated deviations than this, root mean square. Beside noise
of these deviations, poses are then within 2.7 of them."""

LARGEST_CHANGE = 3.0
"""A factor that differs from 1 by more is none: a sign makes 2, and units are seen at once."""

RUNNING = 5
"""Rows of a running mean."""

MOST_NUMBERS = 2_000_000
"""Numbers of the errors that are projected at a time."""


@dataclass(frozen=True)
class GroupFault:
    """A group of measurements that does not agree with the others.

    Attributes:
        test: "dropped", "rows", "factor", "late", "jump", "split", "row factors" or "runs".
        kind: Kind of measurement.
        quantity: What was measured, in words.
        rows: Rows it is about, from 0; empty: all.
        size: Factor, delay in rows, jump in the unit, or number of readings, rows or runs.
        std: Its standard deviation, by the data's own scatter; 0: a count.
        probability: That noise alone does as much.
        moves: By how many of their stated deviations poses move if it is corrected.
        words: All of it.
        counts: Whether it makes a misfit; else it is to be remarked.
    """

    test: str
    kind: str
    quantity: str
    rows: tuple[int, ...]
    size: float
    std: float
    probability: float
    moves: float
    words: str
    counts: bool = True


def group_faults(problem: LeastSquares, result: CalibrationResult) -> tuple[GroupFault, ...]:
    """Groups of measurements that do not agree with the others, the most certain first.

    Args:
        problem: What was solved, with the rows that were dropped.
        result: Its minimum.
    """
    residuals = ProjectedResiduals(problem, Point(result.model, result.stations), result.pose_std)
    lost = [*_explained_rows(residuals), *_undecided_rows(residuals), *_dropped(residuals)]
    systematic = _systematic(residuals) if residuals.degrees > 1.0 else []
    return (*lost, *sorted(systematic, key=lambda fault: fault.probability))


def _dropped(residuals: ProjectedResiduals) -> Iterator[GroupFault]:
    """Sensors, such as roll or the length of a cable, of which too much was thrown out; and kinds
    of measurement of which too much was, though each sensor lost little."""
    lost, measured = residuals.lost, residuals.measured
    level = FALSE_ALARM / (measured.shape[1] + len(residuals.kinds))

    def fault(kind: str, what: str, of: Rows, scatter: float) -> GroupFault | None:
        gone, whole = int(lost[:, of].sum()), int(measured[:, of].sum())
        beyond = float(2.0 * norm.sf(OUTLIER / scatter))
        chance = float(binom.sf(gone - 1, whole, max(beyond, SINGLE_OUTLIERS))) if gone else 1.0
        if gone <= MOST_DROPPED * whole or chance >= level:
            return None
        rows = tuple(np.flatnonzero(lost[:, of].any(axis=1)).tolist())
        words = f"{gone} of {whole} {what} do not fit"
        return GroupFault("dropped", kind, what, rows, gone, 0.0, chance, np.inf, words)

    for kind, columns, scatter in zip(
        residuals.kinds, residuals.columns, residuals.noise, strict=True
    ):
        sensors = [
            fault(kind, f"readings of {residuals.names[c]}", np.array([c]), scatter)
            for c in columns
        ]
        found = [one for one in sensors if one is not None]
        whole = None if found else fault(kind, kind, columns, scatter)
        yield from found if whole is None else [whole]


def _undecided_rows(residuals: ProjectedResiduals) -> Iterator[GroupFault]:
    """Rows that lost more than remains to check their pose: which readings are right is open."""
    freedom = residuals.problem.freedom.count(residuals.at.stations.width)
    spare = np.maximum(residuals.used.sum(axis=1) - freedom, 0)
    lost, gross = residuals.lost.sum(axis=1), residuals.gross.sum(axis=1)
    rows = np.flatnonzero(lost > spare)
    if not len(rows):
        return
    worst = rows[np.argmax(lost[rows])]
    by_kind = [int(residuals.lost[worst][columns].sum()) for columns in residuals.columns]
    kind, count = residuals.kinds[int(np.argmax(by_kind))], len(lost)
    bad = gross > spare
    yield GroupFault(
        "rows", kind, "all readings", tuple(rows.tolist()), len(rows), 0.0, 0.0, np.inf,
        f"{_row_words(rows)} of {count} contradict{'' if len(rows) > 1 else 's'} "
        f"{'themselves' if len(rows) > 1 else 'itself'}: {int(lost[worst])} of "
        f"{int(residuals.measured[worst].sum())} readings of row {worst + 1} do not fit the "
        "others, and which are right is open",
        bool(np.any(bad & (gross > 1)) or bad.sum() > max(1.0, MOST_ROWS * count)),
    )  # fmt: skip


def _explained_rows(residuals: ProjectedResiduals) -> Iterator[GroupFault]:
    """Rows in which nothing has to be thrown out once all they measured of a kind has a factor.

    One factor of several such rows is no chance: outliers have no reason to agree with one.
    """
    rows = np.flatnonzero(residuals.lost.any(axis=1))
    gross = residuals.gross[rows].any(axis=1)
    if len(rows) < FEWEST_EXPLAINED:
        return
    for kind, columns in zip(residuals.kinds, residuals.columns, strict=True):
        off, seen, c = _own_factors(residuals, rows, columns, residuals.measured)
        before, after = (np.max(np.abs(x), axis=1) for x in (off, off - c[:, None] * seen))
        clear = after < np.maximum(LEFT_OVER * before, np.minimum(OUTLIER, HALF * before))
        middle = float(np.median(c[clear])) if clear.any() else 0.0
        agree = clear & (np.abs(c - middle) < AGREEING * abs(middle))
        if np.sum(agree & gross) < FEWEST_EXPLAINED:
            continue
        yield GroupFault(
            "row factors", kind, kind, tuple(rows[agree].tolist()), 1.0 + middle,
            float(np.std(c[agree])), 0.0, np.inf,
            f"{kind} of {_row_words(rows[agree])} are {1.0 + middle:.4g} times what fits the "
            "other rows; with that, nothing of these rows is thrown out",
        )  # fmt: skip


def _own_factors(
    residuals: ProjectedResiduals, rows: Rows, columns: Rows, counted: Flags
) -> tuple[Array, Array, Array]:
    """Factors of columns that each of some rows needs by itself, the model as it is: residuals and
    errors for a change of 1 behind the poses alone, both (k, R), and the change, (k,), or zero."""
    counts = counted[rows]
    B = residuals.slopes[rows] * counts[:, :, None]
    d = np.zeros(counts.shape)
    d[:, columns] = -residuals.expected[rows][:, columns]
    d[~counts | (np.sum(np.any(d != 0.0, axis=0)) < 2)] = 0.0  # of one sensor: a test of its own
    Q = B @ np.linalg.pinv(B)
    off, seen = (
        x - np.einsum("krs,ks->kr", Q, x) for x in (np.where(counts, residuals.whole[rows], 0.0), d)
    )
    size = np.sum(seen**2, axis=1)
    told = size > LEAST_SEEN * np.sum(d**2, axis=1)
    c = np.where(told, np.sum(d * off, axis=1) / np.where(told, size, 1.0), 0.0)
    return off, seen * told[:, None], c


def _row_words(rows: Sequence[int] | Rows) -> str:
    """Numbers of rows, from 1, in words."""
    numbers = ", ".join(str(row + 1) for row in rows[:8])
    more = f" and {len(rows) - 8} more" if len(rows) > 8 else ""
    return f"row{'s' if len(rows) > 1 else ''} {numbers}{more}"


class _Error(NamedTuple):
    """An error that measurements may have.

    Attributes:
        test, quantity: What it is.
        kind: Number of the kind.
        unit: Of its size.
        rows: Rows it is about, from 0; empty: all.
        sets: Sets of so many rows, of which this one was chosen.
        error: Of residuals over sigma for a size of 1, shape (k, R).
    """

    test: str
    quantity: str
    kind: int
    unit: str
    rows: tuple[int, ...]
    sets: float
    error: Array


def _systematic(residuals: ProjectedResiduals) -> list[GroupFault]:
    """Factors, delays, jumps, splits, rows and runs that are certain."""
    errors = _errors(residuals)
    faults = list(_tested(residuals, errors)) if errors else []
    return faults + _runs(residuals, FALSE_ALARM / residuals.r.shape[1])


def _errors(residuals: ProjectedResiduals) -> list[_Error]:
    """Errors that are tested; of jumps, splits and sets of rows the most likely one."""
    count, used, v = len(residuals.r), residuals.used, residuals.expected
    errors: list[_Error] = []

    def put(test: str, name: str, kind: int, unit: str, of: Rows, error: Array) -> None:
        whole = np.zeros(used.shape)
        whole[:, of] = np.where(used[:, of], error, 0.0)
        rows, sets = np.zeros(0, np.intp), 1.0
        if test in ("jump", "split", "row factors"):
            rows = residuals.likely_instant(whole)
            sets = float(count)
            if test == "row factors":
                rows = _likely_rows(residuals, of)
                sets = float(comb(count, len(rows)))
            if not len(rows):
                return
            whole[np.setdiff1d(np.arange(count), rows)] = 0.0
        errors.append(_Error(test, name, kind, unit, tuple(rows.tolist()), sets, whole))

    for g, (kind, columns) in enumerate(zip(residuals.kinds, residuals.columns, strict=True)):
        valued = columns[np.any(v[:, columns] != 0.0, axis=0)]
        for c in valued:
            of, name = np.array([c]), residuals.names[c]
            put("factor", name, g, "-", of, -v[:, of])
            step = np.where(used[:-1, of] & used[1:, of], np.diff(v[:, of], axis=0), 0.0)
            put("late", name, g, "rows", of, np.vstack([step, [[0.0]]]))
            put("late", name, g, "rows", of, np.vstack([[[0.0]], step]))
            put("jump", name, g, residuals.units[c], of, -1.0 / residuals.sigma[:, of])
        if len(valued) > 1:
            put("factor", f"all {kind}", g, "-", valued, -v[:, valued])
            put("split", kind, g, "-", valued, -v[:, valued])
            put("row factors", kind, g, "-", valued, -v[:, valued])
    return errors


def _likely_rows(residuals: ProjectedResiduals, columns: Rows) -> Rows:
    """The fewer of two groups of rows that differ most in the factor of some columns; none where
    that is no more than chance.

    Two groups of numbers with weights w differ by W_1 W_2 / (W_1 + W_2) (c_1 - c_2)^2, which grows
    by about 2 log C(N, n) if n of N are chosen for it.
    """
    _, seen, c = _own_factors(residuals, np.arange(len(residuals.r)), columns, residuals.used)
    w = np.sum(seen**2, axis=1)
    order = np.flatnonzero(w > 0.0)
    order = order[np.argsort(c[order])]
    if len(order) < 2 * END_ROWS:
        return np.zeros(0, np.intp)
    n = np.arange(1, len(order))
    W, along = np.cumsum(w[order]), np.cumsum((w * c)[order])
    low, high = along[:-1] / W[:-1], (along[-1] - along[:-1]) / (W[-1] - W[:-1])
    apart = W[:-1] * (W[-1] - W[:-1]) / W[-1] * (high - low) ** 2
    left = max(float(np.sum((w * c**2)[order])) - along[-1] ** 2 / W[-1], 1e-300)
    chosen = gammaln(len(order) + 1) - gammaln(n + 1) - gammaln(len(order) - n + 1)
    likely = -0.5 * len(order) * np.log(np.maximum(1.0 - apart / left, 1e-12)) - chosen
    best = int(np.argmax(likely))
    if likely[best] <= 0.0:
        return np.zeros(0, np.intp)
    cut = int(n[best])
    return np.sort(order[:cut] if 2 * cut <= len(order) else order[cut:])


def _tested(residuals: ProjectedResiduals, errors: Sequence[_Error]) -> Iterator[GroupFault]:
    """Those of some errors that are likely, one of each test and quantity."""
    best: dict[tuple[str, str], GroupFault] = {}
    at_once = max(1, MOST_NUMBERS // residuals.r.size)
    for begin in range(0, len(errors), at_once):
        _test(residuals, errors[begin : begin + at_once], len(errors), best)
    yield from best.values()


def _test(
    residuals: ProjectedResiduals,
    errors: Sequence[_Error],
    tests: int,
    best: dict[tuple[str, str], GroupFault],
) -> None:
    """Adds errors that are likely, of so many tests, to the best ones."""
    D = np.stack([one.error for one in errors], axis=2)
    projected, prior = residuals.projected(D)
    size = np.einsum("krn,krn->n", D, projected)
    along = np.einsum("kr,krn->n", residuals.r, D)
    whole = np.einsum("krn,krn->n", D, D)
    kinds = residuals.members @ np.einsum("krn,krn->rn", projected, projected)
    own = residuals.members @ np.einsum("kr,krn->rn", residuals.r, projected)
    for n, one in enumerate(errors):
        if size[n] <= LEAST_SEEN * whole[n] or size[n] <= 0.0:
            continue
        c = float(along[n] / size[n])
        if one.unit == "-" and abs(c) > LARGEST_CHANGE:
            continue
        sums = np.maximum(residuals.sums - 2.0 * c * own[:, n] + c**2 * kinds[:, n], 0.0)
        degrees = residuals.degrees_of - kinds[:, n] / size[n]
        variance, freedom = _variance(residuals, sums, degrees, kinds[:, n])
        variance += float(np.sum(prior[:, n] ** 2))
        if freedom < 1.0 or variance <= 0.0:
            continue
        std = float(np.sqrt(variance)) / size[n]
        chance, key = 2.0 * float(t.sf(abs(c) / std, freedom)) * one.sets, (one.test, one.quantity)
        if chance < min(LIKELY / tests, best[key].probability if key in best else 1.0):
            certain = chance < FALSE_ALARM / tests
            best[key] = _fault(residuals, one, (c, std, chance), certain)


def _variance(
    residuals: ProjectedResiduals, sums: Array, degrees: Array, weights: Array
) -> tuple[float, float]:
    """Variance of d' r, and its degrees of freedom by Satterthwaite; of each kind squares of the
    residuals once the error is out, their degrees of freedom, and squares of M d, each (g,)."""
    told = residuals.told & (residuals.sums > 0.0)
    before = np.where(told, residuals.sums / np.where(told, residuals.degrees_of, 1.0), 1.0)
    after = np.where(told, sums / np.maximum(degrees, 1e-9), 1.0)
    parts = residuals.scatter**2 * after / before * weights
    variance = float(np.sum(parts))
    degrees = np.where(told, np.maximum(degrees, 1e-3), residuals.degrees)
    freedom = variance**2 / float(np.sum(parts**2 / degrees) + 1e-300)
    return variance, freedom


def _fault(
    residuals: ProjectedResiduals, one: _Error, found: tuple[float, float, float], certain: bool
) -> GroupFault:
    """An error of some size, deviation and probability, in words, and whether it counts."""
    c, std, chance = found
    moves, what = residuals.moves(c * one.error), one.quantity
    size = 1.0 + c if one.unit == "-" else c
    verb = "is" if what in residuals.names else "are"
    if one.test == "late":
        words = f"{what} is {abs(size):.3g} +- {std:.2g} rows {'late' if size > 0 else 'early'}"
    elif one.test == "jump":
        words = f"{what} jumps at row {one.rows[0] + 1} by {size:.4g} +- {std:.2g} {one.unit}"
    elif one.test == "row factors":
        words = f"{what} of {_row_words(one.rows)} {verb} {size:.4g} times what fits the other rows"
    else:
        where = f"from row {one.rows[0] + 1} on " if one.rows else ""
        words = f"{what} {where}{verb} {size:.4g} +- {std:.2g} times what fits"
    return GroupFault(
        one.test, residuals.kinds[one.kind], what, one.rows, size, std, chance, moves, words,
        certain and moves > MATERIAL,
    )  # fmt: skip


def _runs(residuals: ProjectedResiduals, level: float) -> list[GroupFault]:
    """The sensor whose residuals change their sign too seldom, row by row: a drift.

    It counts where poses would move by the running mean of its residuals.
    """
    best: GroupFault | None = None
    for g, columns in enumerate(residuals.columns):
        for c in columns:
            rows = np.flatnonzero(residuals.used[:, c])
            r = residuals.r[rows, c]
            runs, chance = runs_test(r)
            if chance >= min(level, best.probability if best else 1.0):
                continue
            error = np.zeros(residuals.r.shape)
            error[rows, c] = np.convolve(r, np.full(RUNNING, 1.0 / RUNNING), "same")
            moves, name = residuals.moves(error), residuals.names[c]
            best = GroupFault(
                "runs", residuals.kinds[g], name, tuple(rows.tolist()), runs, 0.0, chance, moves,
                f"residuals of {name} have one sign for long: {runs} times positive in "
                f"{len(rows)} rows: a drift, or an error that varies with the pose",
                moves > MATERIAL,
            )  # fmt: skip
    return [] if best is None else [best]


def runs_test(r: Array) -> tuple[int, float]:
    """Number of runs of positive numbers, and the probability of so few if order is by chance.

    With n positive numbers and m others, j runs are C(n - 1, n - j) C(m + 1, j) of C(n + m, n)
    orders: a hypergeometric distribution.
    """
    positive = np.concatenate([[False], np.asarray(r) > 0.0])
    count = int(positive.sum())
    runs = int(np.sum(positive[1:] & ~positive[:-1]))
    if count in (0, len(r)):
        return runs, 1.0
    return runs, float(hypergeom.cdf(runs, len(r), len(r) - count + 1, count))
