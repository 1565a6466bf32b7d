"""Whether groups of a fit's measurements agree: quantities, rows, and the factors they need.

At a minimum the residuals over sigma are r = M e, with e the noise and M the projector off all that
parameters and poses can follow. A systematic error c d, such as all lengths of a cable being a
share c too long (d: minus these lengths over sigma, else 0), leaves c M d in them, so that

    c = d' r / d' M d,    t = d' r / sqrt(sum over kinds g of s_g^2 |(M d)_g|^2)

estimates it and tests it. s_g, the scatter of a kind of measurement over its stated sigma, is that
of the residuals themselves once c d is taken out: sigmas that are too large or too small by a
factor change no test, and an error does not hide behind the scatter that it makes. t has Student's
distribution, with degrees of freedom by Satterthwaite's rule.

An error makes a misfit where it is certain (`FALSE_ALARM` over the number of tests, with an
allowance for errors of the model, `MODEL_ERROR`), larger than the scatter itself, and where it
moves poses by more than their stated deviations (`MATERIAL`). Errors that are large beside the
stated sigma are thrown out of the fit instead: there the shares of a sensor, a kind and a row are
limited (`MOST_DROPPED`), and one factor that explains several such rows is sought.

Source: Lagrange-multiplier test of omitted variables: Cook and Weisberg, Residuals and influence in
regression, 1982, 2.2; Baarda, A testing procedure for use in geodetic networks, 1968, for tests of
gross errors behind a projector; Rao, Estimation of variance components, 1971, for s_g;
Satterthwaite, An approximate distribution of estimates of variance components, 1946.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigh
from scipy.optimize import nnls
from scipy.stats import binom, f, norm, t

from cdpr_drake.arrays import Array
from cdpr_drake.calibration.elimination import UNTOLD, LeastSquares
from cdpr_drake.calibration.pose_search import OUTLIER
from cdpr_drake.calibration.result import CalibrationResult, used_rows
from cdpr_drake.calibration.stations import POSE, Point
from cdpr_drake.calibration.terms import Term

FALSE_ALARM = 1e-4
"""Probability that noise alone makes a log a misfit; of 200 logs, 2 % have a false alarm. Each of n
tests has this over n (Bonferroni)."""

MOST_DROPPED = 1.0 / 3.0
"""Share of a quantity's readings that may be thrown out."""

MOST_OF_KIND = 0.1
"""Share of the readings of a kind, over all sensors, that may be thrown out."""

SINGLE_OUTLIERS, TRUNCATED = 0.02, 1.1
"""Share of a kind that single outliers are expected to be, and by how much its scatter is larger
than that of the readings that remain, where noise is twice its sigma."""

DROPPED_BY_NOISE = 0.05
"""Share that noise of twice the stated sigma throws out: P(|x| > 4 / 2) = 0.0455."""

MOST_ROWS = 0.05
"""Share of rows that may have lost so many of their readings."""

FEWEST_DROPPED = 3
"""So many readings of a kind that a row loses make it a bad row."""

MODEL_ERROR = 2.5
"""Errors of a robot's model, such as of its geometry, are no white noise: they shift directions by
more than scatter says. t counts as that of noise so many times larger, F as of its square. Chosen,
and not derived: with 1 the public log of IRMA4U, whose model has such errors, is a misfit."""

MATERIAL = 1.5
"""An error moves poses by more of their stated deviations than this, root mean square."""

FAR = 5.0
"""An error that moves poses by more of their deviations is none of a model: it has to be certain
beside scatter alone."""

LEAST_FACTOR = 0.01
"""Factors nearer to 1 are remarked: stretch of cables, or a drum's radius, makes as much."""

ABOVE_SCATTER = 1.5
"""An error is this many times the scatter of readings, root mean square, where it acts."""

MOST_SPLITS, MOST_JUMPS, END_ROWS = 100, 30, 3
"""Instants at which a log is split in two, and a sensor may jump; rows on each side at least."""

MOST_ROW_TESTS = 200
"""Rows whose own factors are compared, spread over the log."""

BLOCK = 64
"""Directions that are projected at once."""


@dataclass(frozen=True)
class GroupFault:
    """A group of measurements that does not agree with the others.

    Attributes:
        test: "dropped", "rows", "factor", "late", "jump", "split" or "row factors".
        kind: Kind of measurement.
        quantity: What was measured, in words.
        rows: Rows it is about, from 0; empty: all.
        size: Factor, delay in rows, jump in the unit, or number of readings.
        std: Its standard deviation, by the data's own scatter; 0: a count.
        probability: That noise alone does as much.
        moves: By how many of their stated deviations poses or parameters move if it is corrected.
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
    at = Point(result.model, result.stations)
    used = [used_rows(problem, k) for k in range(len(problem.terms))]
    residuals = _Residuals(problem, at, used, result.pose_std)
    dropped = [
        *_explained_rows(problem, at, used), *_dropped_quantities(residuals, used),
        *_dropped_rows(problem, at, used),
    ]  # fmt: skip
    systematic = _systematic(residuals) if residuals.degrees > 1.0 else []
    return (*dropped, *sorted(systematic, key=lambda fault: fault.probability))


def _dropped_quantities(
    residuals: _Residuals, used: Sequence[npt.NDArray[np.bool_]]
) -> list[GroupFault]:
    """Single sensors, such as roll or the length of a cable, of which too much was thrown out; and
    kinds of measurement of which too much was, though each sensor lost little."""
    faults: list[GroupFault] = []
    problem, at = residuals.problem, residuals.at
    count = sum(1 + term.measured().any(axis=0).sum() for term in problem.terms)

    def look(
        kind: str, what: str, lost: npt.NDArray[np.bool_], whole: int, most: float, expected: float
    ) -> bool:
        gone = int(lost.sum())
        chance = float(binom.sf(gone - 1, whole, expected)) if gone else 1.0
        if gone <= most * whole or chance >= FALSE_ALARM / count:
            return False
        rows = tuple(np.flatnonzero(lost.reshape(len(lost), -1).any(axis=1)).tolist())
        words = f"{gone} of {whole} {what} do not fit"
        faults.append(GroupFault("dropped", kind, what, rows, gone, 0.0, chance, np.inf, words))
        return True

    for term, counted, scatter in zip(problem.terms, used, residuals.scatter, strict=True):
        measured = term.measured()
        lost, named = measured & ~counted, False
        for column in np.flatnonzero(lost.any(axis=0)).tolist():
            what = f"readings of {term.row_name(column, at.model.names)}"
            whole = int(measured[:, column].sum())
            named |= look(term.kind, what, lost[:, column], whole, MOST_DROPPED, DROPPED_BY_NOISE)
        if not named:
            beyond = 2.0 * norm.sf(OUTLIER / max(TRUNCATED * scatter, 1e-9))
            expected = max(float(beyond), SINGLE_OUTLIERS)
            look(term.kind, term.kind, lost, int(measured.sum()), MOST_OF_KIND, expected)
    return faults


def _dropped_rows(
    problem: LeastSquares, at: Point, used: Sequence[npt.NDArray[np.bool_]]
) -> list[GroupFault]:
    """Rows that lost half of what they measured of one kind, or more."""
    spare = sum(counted.sum(axis=1) for counted in used)
    spare = spare - problem.freedom.count(at.stations.width)
    faults = []
    for term, counted in zip(problem.terms, used, strict=True):
        whole = term.measured().sum(axis=1)
        gone = whole - counted.sum(axis=1)
        bad = (gone >= FEWEST_DROPPED) & (2 * gone >= whole)
        rows = np.flatnonzero(bad)
        if not len(rows):
            continue
        many = len(rows) > max(1.0, MOST_ROWS * len(whole))
        faults.append(
            GroupFault(
                "rows", term.kind, term.kind, tuple(rows.tolist()), len(rows), 0.0, 0.0, np.inf,
                f"{_row_words(rows)} of {len(whole)} lost half of their {term.kind}, or more",
                bool(many or (spare[rows] <= 0).any()),
            )
        )  # fmt: skip
    return faults


def _explained_rows(
    problem: LeastSquares, at: Point, used: Sequence[npt.NDArray[np.bool_]]
) -> list[GroupFault]:
    """Rows in which nothing has to be thrown out once all they measured of a kind has a factor.

    One factor of several such rows is no chance: outliers have no reason to agree with one.
    """
    whole = replace(problem, dropped=None)
    lost = [term.measured() & ~counted for term, counted in zip(problem.terms, used, strict=True)]
    rows = np.flatnonzero(np.any(np.concatenate(lost, axis=1), axis=1))
    if len(rows) < FEWEST_EXPLAINED:
        return []
    evaluated, _, B = whole.evaluate(at)
    r, B = evaluated[rows], B[rows]
    hat = B @ np.linalg.solve(np.swapaxes(B, 1, 2) @ B, np.swapaxes(B, 1, 2))
    faults, begin = [], 0
    for term in problem.terms:
        inside = slice(begin, begin + term.measured().shape[1])
        begin = inside.stop
        values = _expected(term, evaluated[:, inside], at)[rows]
        if np.sum(np.any(values != 0.0, axis=0)) < 2:
            continue
        d = np.zeros(r.shape)
        d[:, inside] = -values
        off, seen = (x - np.einsum("krs,ks->kr", hat, x) for x in (r, d))
        size = np.sum(d * seen, axis=1)
        told = size > LEAST_ROW_SEEN * np.sum(d**2, axis=1)
        c = np.where(told, np.sum(d * off, axis=1) / np.where(told, size, 1.0), 0.0)
        before, after = (np.max(np.abs(x), axis=1) for x in (off, off - c[:, None] * seen))
        clear = told & (before > GROSS * OUTLIER) & (np.abs(c) > LEAST_FACTOR)
        clear &= after < np.maximum(OUTLIER, LEFT_OVER * before)
        if not clear.any():
            continue
        middle = float(np.median(c[clear]))
        agree = clear & (np.abs(c - middle) < AGREEING * abs(middle))
        if agree.sum() < FEWEST_EXPLAINED:
            continue
        factor = 1.0 + middle
        faults.append(
            GroupFault(
                "row factors", term.kind, term.kind, tuple(rows[agree].tolist()), factor,
                float(np.std(c[agree])), 0.0, np.inf,
                f"{term.kind} of {_row_words(rows[agree])} are {factor:.4g} times what fits the "
                "other rows; with that, nothing of these rows is thrown out",
            )
        )  # fmt: skip
    return faults


FEWEST_EXPLAINED = 2
"""Rows that one factor explains."""

GROSS = 2.0
"""So many times the limit of outliers are off in them: noise of twice its sigma is no error."""

LEFT_OVER, AGREEING = 0.1, 0.2
"""Share of the largest residual of a row that its factor leaves, since poses turn with it; and
share by which factors of rows differ from their median."""


def _row_words(rows: Sequence[int] | npt.NDArray[np.intp]) -> str:
    """Numbers of rows, from 1, in words."""
    numbers = ", ".join(str(row + 1) for row in rows[:8])
    more = f" and {len(rows) - 8} more" if len(rows) > 8 else ""
    return f"row{'s' if len(rows) > 1 else ''} {numbers}{more}"


class _Residuals:
    """Residuals at a minimum, and the projector M that is behind them.

    All arrays are over sigma and in typical sizes; rows of all terms stand beside each other.

    Attributes:
        r: Residuals, shape (k, R); zero where none counts.
        kinds: Which term a column belongs to, shape (R,).
        degrees: Degrees of freedom of each kind, trace of M, shape (g,).
        scatter: s_g of each kind, shape (g,).
    """

    def __init__(
        self, problem: LeastSquares, at: Point, used: Sequence[npt.NDArray[np.bool_]],
        pose_std: Array,
    ) -> None:  # fmt: skip
        self.problem, self.at, self.pose_std = problem, at, pose_std
        self.used = np.concatenate(used, axis=1)
        self.kinds = np.repeat(np.arange(len(used)), [counted.shape[1] for counted in used])
        self.members = np.array([self.kinds == g for g in range(len(used))], float)
        r, A, B = problem.evaluate(at)
        self.r, self._A, self._B = np.where(self.used, r, 0.0), A, B
        H = np.swapaxes(B, 1, 2) @ B
        self._Bt = np.linalg.solve(H, np.swapaxes(B, 1, 2))  # (k, q, R)
        self.A = A - B @ (self._Bt @ A)
        typical = at.layout.typical[problem.free]
        self._prior = problem.prior.evaluate(at, problem.free)[1] * typical
        flat = self.A.reshape(self.r.size, A.shape[2])
        self._inverse = _told_inverse(flat.T @ flat + self._prior.T @ self._prior)
        self._components()

    def _components(self) -> None:
        """Degrees of freedom and scatter of each kind, by variance components."""
        g, V = len(self.members), self._inverse
        alone = self._B @ self._Bt
        own = np.where(self.used, 1.0, 0.0)
        hat = np.einsum("krf,fh,krh->kr", self.A, V, self.A)
        diagonal = own - np.einsum("krr->kr", alone) - hat
        self.degrees_of = self.members @ diagonal.sum(axis=0)
        self.degrees = float(self.degrees_of.sum())
        by_kind = [self.A * member[None, :, None] for member in self.members]
        S = np.array([np.einsum("krf,krh->fh", part, part) for part in by_kind])
        rest = np.eye(alone.shape[1]) * own[:, :, None] - alone
        squares = np.einsum("gr,krs,hs->gh", self.members, rest**2, self.members)
        for a in range(g):
            for b in range(g):
                crossed = np.einsum("krf,krs,ksh->fh", by_kind[a], rest, by_kind[b])
                squares[a, b] += np.sum((V @ S[a]) * (V @ S[b]).T) - 2.0 * np.sum(crossed * V)
        P = self._prior.T @ self._prior
        known = np.array([np.sum((V @ S[a]) * (V @ P).T) for a in range(g)])
        sums = self.members @ np.sum(self.r**2, axis=0)
        found, _ = nnls(squares, np.maximum(sums - known, 0.0))
        plain = sums / np.maximum(self.degrees_of, 1e-9)
        self.sums, self._S, self._P = sums, S, P
        self.scatter = np.sqrt(np.maximum(found, LEAST_COMPONENT * plain) + 1e-30)

    def projected(self, D: Array) -> tuple[Array, Array]:
        """M D of directions, shape (k, R, n), and its prior rows, shape (p, n)."""
        D = D - self._B @ (self._Bt @ D)
        along = self._inverse @ np.einsum("krf,krn->fn", self.A, D)
        return D - self.A @ along, -self._prior @ along

    def moves(self, error: Array) -> float:
        """By how many stated deviations poses move by an error, root mean square.

        Args:
            error: Of residuals over sigma, shape (k, R).
        """
        eliminated = error - np.einsum("krq,kqs,ks->kr", self._B, self._Bt, error)
        theta = self._inverse @ np.einsum("krf,kr->f", self.A, eliminated)
        rest = error - self._A @ theta
        steps = (self._Bt @ rest[:, :, None])[:, :, 0] * self.problem.station_scale(self.at)
        stations = self.at.stations
        wide = self.problem.freedom.widen(steps, stations.R, stations.width)
        sizes = np.column_stack(
            [np.linalg.norm(wide[:, :3], axis=1), np.linalg.norm(wide[:, 3:POSE], axis=1)]
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            ratios = np.where(self.pose_std > 0.0, sizes / self.pose_std, 0.0)
        return float(np.max(np.sqrt(np.mean(ratios**2, axis=0))))


LEAST_COMPONENT = 0.1
"""A variance component is no smaller than this share of the kind's own mean square over its degrees
of freedom, which holds where readings of few degrees leave components undecided."""


def _told_inverse(S: Array) -> Array:
    """Inverse of an information in what it tells, as `symmetric_solve` has it."""
    if not len(S):
        return S
    values, V = eigh(0.5 * (S + S.T))
    told = values > UNTOLD**2
    return np.asarray((V[:, told] / values[told]) @ V[:, told].T)


@dataclass(frozen=True, eq=False)
class _Direction:
    """An error that measurements may have.

    Attributes:
        test, quantity, kind, unit: What it is.
        rows: Rows it is about, from 0.
        error: Of residuals over sigma for a size of 1, shape (k, R).
    """

    test: str
    quantity: str
    kind: int
    unit: str
    rows: tuple[int, ...]
    error: Array


def _systematic(residuals: _Residuals) -> list[GroupFault]:
    """Factors, delays, jumps and splits that are certain."""
    directions = _directions(residuals)
    kinds = _valued_kinds(residuals)
    tests = len(directions) + len(kinds)
    level = FALSE_ALARM / max(tests, 1)
    best: dict[tuple[str, str], GroupFault] = {}
    for begin in range(0, len(directions), BLOCK):
        some = directions[begin : begin + BLOCK]
        for fault in _tested(residuals, some, level):
            key = (fault.test, fault.quantity)
            if key not in best or fault.probability < best[key].probability:
                best[key] = fault
    faults = list(best.values())
    for kind in kinds:
        faults += _row_factors(residuals, kind, level)
    return faults


def _expected(term: Term, r: Array, at: Point) -> Array:
    """What the fit expects a term to have measured, over sigma, shape (k, rows).

    Measured values would not do in its place: the noise in them fits itself with a factor of 0.
    """
    values = term.values(at) / term.sigmas()
    valued = np.any(np.nan_to_num(values) != 0.0, axis=0)
    return np.where(term.measured() & valued, values + r, 0.0)


def _values(residuals: _Residuals) -> Array:
    """What the fit expects over sigma, shape (k, R); zero where a factor means nothing."""
    ends = np.cumsum([term.measured().shape[1] for term in residuals.problem.terms])[:-1]
    parts = [
        _expected(term, r, residuals.at)
        for term, r in zip(
            residuals.problem.terms, np.split(residuals.r, ends, axis=1), strict=True
        )
    ]
    return np.where(residuals.used, np.concatenate(parts, axis=1), 0.0)


def _valued_kinds(residuals: _Residuals) -> list[int]:
    values = _values(residuals)
    return [g for g, member in enumerate(residuals.members) if np.any(values * member)]


def _directions(residuals: _Residuals) -> list[_Direction]:
    values, used, terms = _values(residuals), residuals.used, residuals.problem.terms
    count = len(values)
    splits, jumps = _instants(count, MOST_SPLITS), _instants(count, MOST_JUMPS)
    directions: list[_Direction] = []
    begin = 0
    for g, term in enumerate(terms):
        width = term.measured().shape[1]
        inside = slice(begin, begin + width)
        begin += width
        valued = np.flatnonzero(np.any(values[:, inside] != 0.0, axis=0))
        if not len(valued):
            continue
        names = [term.row_name(int(c), residuals.at.model.names) for c in range(width)]
        units = [term.row_unit(int(c)) for c in range(width)]

        put = partial(_put, directions, used, g)
        sigma = term.sigmas()
        for c in valued.tolist():
            at, v = begin - width + c, values[:, begin - width + c]
            put(("factor", names[c], "-"), (), of=at, error=-v)
            both = used[:-1, at] & used[1:, at]
            ahead = np.append(np.where(both, np.diff(v), 0.0), 0.0)
            put(("late", names[c], "rows"), (), of=at, error=ahead)
            behind = np.append(0.0, np.where(both, np.diff(v), 0.0))
            put(("late", names[c], "rows"), (), of=at, error=behind)
            for split in jumps:
                late = np.arange(count) >= split
                put(
                    ("jump", names[c], units[c]),
                    range(split, count),
                    of=at,
                    error=-(late / sigma[:, c]),
                )
        if len(valued) > 1:
            put(("factor", f"all {term.kind}", "-"), (), of=inside, error=-values[:, inside])
            for split in splits:
                late = (np.arange(count) >= split)[:, None]
                error = -values[:, inside] * late
                put(("split", term.kind, "-"), range(split, count), of=inside, error=error)
    return directions


def _instants(count: int, most: int) -> list[int]:
    """Rows at which a log is split, at most so many, with rows enough on each side."""
    if count < 2 * END_ROWS:
        return []
    steps = np.linspace(END_ROWS, count - END_ROWS, min(most, count - 2 * END_ROWS + 1))
    return sorted({round(float(step)) for step in steps})


def _put(
    directions: list[_Direction], used: npt.NDArray[np.bool_], kind: int,
    what: tuple[str, str, str], rows: Sequence[int], *, of: int | slice, error: Array,
) -> None:  # fmt: skip
    """Adds an error of some columns, where they count; `what`: test, quantity and unit."""
    whole = np.zeros(used.shape)
    whole[:, of] = error
    whole[~used] = 0.0
    test, name, unit = what
    directions.append(_Direction(test, name, kind, unit, tuple(rows), whole))


def _tested(
    residuals: _Residuals, directions: Sequence[_Direction], level: float
) -> list[GroupFault]:
    """Those of some directions that are certain."""
    D = np.stack([direction.error for direction in directions], axis=2)
    projected, prior = residuals.projected(D)
    size = np.einsum("krn,krn->n", D, projected)
    along = np.einsum("kr,krn->n", residuals.r, D)
    whole = np.einsum("krn,krn->n", D, D)
    kinds = residuals.members @ np.einsum("krn,krn->rn", projected, projected)
    own = residuals.members @ np.einsum("kr,krn->rn", residuals.r, projected)
    faults = []
    for n, direction in enumerate(directions):
        if size[n] <= LEAST_SEEN * whole[n] or size[n] <= 0.0:
            continue
        c = along[n] / size[n]
        if direction.test in ("factor", "split") and abs(c) > LARGEST_CHANGE:
            continue
        sums = np.maximum(residuals.sums - 2.0 * c * own[:, n] + c**2 * kinds[:, n], 0.0)
        degrees = residuals.degrees_of - kinds[:, n] / size[n]
        variance, freedom, scatter = _variance(residuals, sums, degrees, kinds[:, n])
        variance += float(np.sum(prior[:, n] ** 2))
        if freedom < 1.0 or variance <= 0.0:
            continue
        std = float(np.sqrt(variance)) / size[n]
        plain, chance = 2.0 * t.sf(abs(c) / std / np.array([1.0, MODEL_ERROR]), freedom)
        if plain >= level:
            continue
        fault = _fault(residuals, direction, float(c), std, float(chance), scatter[direction.kind])
        if chance >= level and fault.moves > FAR:
            fault = replace(fault, probability=float(plain))
        if fault.probability < level:
            faults.append(fault)
    return faults


LARGEST_CHANGE = 3.0
"""A factor that differs from 1 by more is none: a sign makes 2, and units are seen at once."""

LEAST_SEEN = 1e-6
"""Share of an error that residuals show; of less, rounding decides."""


def _variance(
    residuals: _Residuals, sums: Array, degrees: Array, weights: Array
) -> tuple[float, float, Array]:
    """Of d' r, its degrees of freedom by Satterthwaite, and the scatter of each kind.

    Args:
        residuals: All of them.
        sums: Squares of the residuals of each kind once the error is out, shape (g,).
        degrees: Their degrees of freedom, shape (g,).
        weights: Squares of M d in each kind, shape (g,).
    """
    before = residuals.sums / np.maximum(residuals.degrees_of, 1e-9)
    after = sums / np.maximum(degrees, 1e-9)
    ratio = np.where(before > 0.0, after / np.maximum(before, 1e-300), 1.0)
    squares = residuals.scatter**2 * ratio
    parts = squares * weights
    variance = float(np.sum(parts))
    freedom = variance**2 / float(np.sum(parts**2 / np.maximum(degrees, 1e-3)) + 1e-300)
    return variance, freedom, np.sqrt(squares)


def _fault(
    residuals: _Residuals, direction: _Direction, c: float, std: float, chance: float,
    scatter: float,
) -> GroupFault:  # fmt: skip
    """An error that is certain, in words, and whether it counts."""
    error = c * direction.error
    acts = direction.error != 0.0
    above = float(np.sqrt(np.mean(error[acts] ** 2))) / max(scatter, 1e-30)
    moves = residuals.moves(error)
    size, what, rows = c, direction.quantity, direction.rows
    large = direction.test not in ("factor", "split") or abs(c) > LEAST_FACTOR
    if direction.test in ("factor", "split"):
        size = 1.0 + c
        where = "" if direction.test == "factor" else f"from row {rows[0] + 1} on "
        verb = "are" if what.startswith("all ") or where else "is"
        words = f"{what} {where}{verb} {size:.4g} +- {std:.2g} times what fits"
    elif direction.test == "late":
        words = f"{what} is {abs(size):.3g} +- {std:.2g} rows {'late' if size > 0 else 'early'}"
    else:
        words = f"{what} jumps at row {rows[0] + 1} by {size:.4g} +- {std:.2g} {direction.unit}"
    kind = residuals.problem.terms[direction.kind].kind
    return GroupFault(
        direction.test, kind, what, rows, size, std, chance, moves, words,
        large and above > ABOVE_SCATTER and moves > MATERIAL,
    )  # fmt: skip


def _row_factors(residuals: _Residuals, kind: int, level: float) -> list[GroupFault]:
    """Whether rows of a kind need factors of their own: rows that are off, wherever they stand."""
    values = _values(residuals) * residuals.members[kind]
    rows = np.flatnonzero(np.any(values, axis=1))
    if len(rows) > MOST_ROW_TESTS:
        rows = rows[np.linspace(0, len(rows) - 1, MOST_ROW_TESTS).astype(int)]
    B, Bt, A, V = residuals._B[rows], residuals._Bt[rows], residuals.A[rows], residuals._inverse
    d = -values[rows]
    rest = d - (B @ (Bt @ d[:, :, None]))[:, :, 0]
    seen = np.sum(rest**2, axis=1) > LEAST_ROW_SEEN * np.sum(d**2, axis=1)
    rows, d, rest, A = rows[seen], d[seen], rest[seen], A[seen]
    if len(rows) < 2 * END_ROWS:
        return []
    a = np.einsum("krf,kr->kf", A, rest)
    aV = a @ V
    size = np.diag(np.sum(rest**2, axis=1)) - aV @ a.T
    along = np.sum(residuals.r[rows] * d, axis=1)
    c = np.linalg.pinv(size, rcond=1e-8, hermitian=True) @ along
    error = np.zeros(values.shape)
    error[rows] = c[:, None] * d
    projected, _ = residuals.projected(error[:, :, None])
    left = residuals.r - projected[:, :, 0]
    shares = np.array([
        np.sum((rest**2) @ member / np.maximum(np.sum(rest**2, axis=1), 1e-300))
        for member in residuals.members
    ])  # fmt: skip
    sums = residuals.members @ np.sum(left**2, axis=0)
    degrees = residuals.degrees_of - shares
    weights = residuals.members @ np.sum(rest**2, axis=0)
    _, freedom, scatter = _variance(residuals, sums, degrees, weights)
    if freedom < 2.0 or np.any((degrees < 1.0) & (shares > 0.5)):
        return []
    C = aV @ residuals._P @ aV.T
    for g, member in enumerate(residuals.members):
        mine = rest * member
        u = np.einsum("krf,kr->kf", A * member[None, :, None], mine)
        crossed = u @ aV.T
        C += scatter[g] ** 2 * (
            np.diag(np.sum(mine**2, axis=1)) - crossed - crossed.T + aV @ residuals._S[g] @ aV.T
        )
    w, Q = eigh(0.5 * (C + C.T))
    told = w > 1e-9 * w[-1]
    rank = int(told.sum())
    statistic = float(np.sum((Q[:, told].T @ along) ** 2 / w[told])) / rank
    chance = float(f.sf(statistic / MODEL_ERROR**2, rank, freedom))
    if chance >= level:
        return []
    off = _fewer(c)
    error = np.zeros(values.shape)
    error[rows] = (c * off - np.mean(c[~off]) * off)[:, None] * d
    above = float(np.sqrt(np.mean(error[error != 0.0] ** 2))) / max(scatter[kind], 1e-30)
    moves = residuals.moves(error)
    name = residuals.problem.terms[kind].kind
    factor = 1.0 + np.mean(c[off]) - np.mean(c[~off])
    return [
        GroupFault(
            "row factors", name, name, tuple(rows[off].tolist()), float(factor),
            float(np.std(c[off])), chance, moves,
            f"{name} of {_row_words(rows[off])} are {factor:.4g} times what fits the other rows",
            abs(factor - 1.0) > LEAST_FACTOR and above > ABOVE_SCATTER and moves > MATERIAL,
        )
    ]  # fmt: skip


LEAST_ROW_SEEN = 1e-6
"""Share of a row's factor that its own residuals show; of less, its pose follows it."""


def _fewer(c: Array) -> npt.NDArray[np.bool_]:
    """The smaller of two groups of numbers, those with the least squares about their means."""
    order = np.argsort(c)
    best, cut = np.inf, 1
    for k in range(1, len(c)):
        low, high = c[order[:k]], c[order[k:]]
        cost = float(np.sum((low - low.mean()) ** 2) + np.sum((high - high.mean()) ** 2))
        if cost < best:
            best, cut = cost, k
    larger: npt.NDArray[np.bool_] = np.isin(np.arange(len(c)), order[cut:])
    return larger if 2 * larger.sum() <= len(c) else np.isin(np.arange(len(c)), order[:cut])
