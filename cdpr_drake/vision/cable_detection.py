"""Cables in images: found as lines beside where they are believed, their sag and its covariance.

The believed pose and cables put the two ends of a cable into space; a cable that hangs does so in
the vertical plane through them. `find_sags` looks into the image along that plane: a strip of it,
stations along the cable by drops below the line between the ends, is read from the image, thin dark
lines are made out in each station, and the inextensible catenary that most of them are on is fitted
to them, with what the ends may be off, and with the error of the believed pose, which moves the
whole curve in the image. The fit's covariance is that of the sag. Neighbouring stations do not err
independently of each other: by the correlation of their residuals they count for fewer.

Source: servoing thesis, perspectives; Irvine, Cable Structures, 1981, 1.1 and 2.1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import exponential
from cdpr_drake.vision.cable_images import (
    LEAST_ANGLE,
    LEAST_SPAN,
    catenary_drop,
    drop_per_root,
)
from cdpr_drake.vision.pinhole import Pinhole

TAUT, SLACK, UNSEEN = 0, 1, -1
"""Verdicts on a cable."""


@dataclass(frozen=True, kw_only=True)
class SightSettings:
    """How cables are looked for.

    Attributes:
        largest_sag: Of the chord, up to which a cable is looked for [-].
        spacing: Of stations along the cable [px]: nearer ones would look at the same pixels.
        step: Of drops [px].
        line: Standard deviation of the filter that makes out thin lines [px].
        contrast: Least response of a line, in standard deviations of the strip's noise, and at
            least so many grey levels.
        levels: See `contrast`.
        near: How far from a curve a line may be to be on it [px].
        share: Of the stations that must have a line on the curve.
        noise: By how much a line is off its curve, about [px].
        ends: Standard deviation of each coordinate of where an end is, by the errors of points,
            and by those of the pose where `find_sags` is not told its covariance [m].
        least_sag: From which a cable counts as slack [m].
        sigmas: By how many standard deviations a sag must be above zero to count.
    """

    largest_sag: float = 0.35
    spacing: float = 4.0
    step: float = 0.5
    line: float = 0.9
    contrast: float = 3.0
    levels: float = 4.0
    near: float = 1.5
    share: float = 0.5
    noise: float = 0.4
    ends: float = 1e-3
    least_sag: float = 0.01
    sigmas: float = 3.0


@dataclass(frozen=True)
class SeenSags:
    """Cables as an image shows them; NaN and `UNSEEN` where it does not show them well enough.

    Attributes:
        sag: How far the middle hangs below the line between the ends, shape (m,) [m]; of a taut
            cable as often a little less than nothing as more.
        sigma: Its standard deviation by the fit, shape (m,) [m].
        surplus: Length less the distance of the ends, not negative, shape (m,) [m].
        surplus_sigma: By how much it is larger for a sag that is larger by its standard deviation,
            shape (m,) [m].
        verdict: `TAUT`, `SLACK` or `UNSEEN`, shape (m,).
        points: Pixels of the points that the curve of each cable was fitted to, shape (2, n) [px].
    """

    sag: Array
    sigma: Array
    surplus: Array
    surplus_sigma: Array
    verdict: np.ndarray
    points: list[Array]


def find_sags(
    image: np.ndarray,
    cables: CableSet,
    X_WP: RigidTransform,
    X_WE: RigidTransform,
    pinhole: Pinhole,
    settings: SightSettings | None = None,
    *,
    pose_covariance: Array | None = None,
) -> SeenSags:
    """Sags of cables in an image.

    Args:
        image: Shape (height, width, 3 or 4) or (height, width), 8 bits a channel.
        cables: The cables as believed.
        X_WP: The platform's pose as believed [m].
        X_WE: The camera E in W as believed [m].
        pinhole: Its intrinsic parameters; without a lens.
        settings: How they are looked for; None: the defaults.
        pose_covariance: Of the twist (w, v) of P in P by which the believed pose is off, shape
            (6, 6) [rad, m]; None: `settings.ends` has it.

    Raises:
        CableGeometryError: An anchor point lies in the groove of its pulley.
        CdprError: The covariance is of another shape, or none.
    """
    wanted = settings or SightSettings()
    grey = image if image.ndim == 2 else cv2.cvtColor(
        np.ascontiguousarray(image[:, :, :3]), cv2.COLOR_RGB2GRAY
    )  # fmt: skip
    grey = grey.astype(np.float32)
    paths = cable_paths(X_WP, cables)
    ends = paths.p_WT + paths.free * paths.u_W
    m = cables.count
    found = np.full((4, m), np.nan)
    verdict, points = np.full(m, UNSEEN), [np.empty((2, 0))] * m
    moved = _moved_ends(cables, X_WP, pose_covariance)
    strips = [
        _Strip.of(paths.p_WT[:, k], ends[:, k], X_WE, pinhole, wanted, moved[:, :, :, k])
        for k in range(m)
    ]
    for k, fit in _shared_out(strips, grey, wanted).items():
        strip = strips[k]
        assert strip is not None
        if fit.sag < -IMPOSSIBLE * fit.sigma:  # no cable hangs upwards: its line is not its own
            continue
        points[k] = fit.uv
        # By the sag's own growth with the root, about constant.
        flat = drop_per_root(strip.span, strip.rise)
        per_root = flat if abs(fit.root) < STEP else fit.sag / fit.root
        root, of_root = max(fit.root, 0.0), fit.sigma / per_root
        found[:, k] = fit.sag, fit.sigma, root**2, 2.0 * root * of_root + of_root**2
        # A sag is known to be there, and more than what is left alone.
        least = max(wanted.least_sag, wanted.sigmas * fit.sigma)
        verdict[k] = SLACK if fit.sag > least else TAUT
    sag, sigma, surplus, surplus_sigma = found
    return SeenSags(sag, sigma, surplus, surplus_sigma, verdict, points)


def _moved_ends(cables: CableSet, X_WP: RigidTransform, covariance: Array | None) -> Array:
    """Ends of cables by poses that are off by a standard deviation along each independent
    direction, shape (q, 2, 3, m) [m]; q = 0 without a covariance."""
    if covariance is None:
        return np.empty((0, 2, 3, cables.count))
    given = np.asarray(covariance, float)
    values, vectors = np.linalg.eigh(given) if given.shape == (6, 6) else (np.array([-1.0]), given)
    if not np.all(np.isfinite(given)) or np.min(values) < -1e-9 * np.max(np.abs(values)):
        raise CdprError(
            f"pose_covariance: found shape {given.shape} with least eigenvalue {np.min(values):g}; "
            "accepted: a covariance of (w, v), shape (6, 6) [rad, m]"
        )
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        paths = cable_paths(X_WP @ exponential(np.sqrt(max(value, 0.0)) * vector), cables)
        found.append([paths.p_WT, paths.p_WT + paths.free * paths.u_W])
    return np.array(found)


@dataclass(frozen=True)
class _Fit:
    """A cable's curve in the image.

    Attributes:
        root: Of the surplus, negative for a curve above the line [m^0.5].
        sag: See `SeenSags` [m].
        sigma: Its standard deviation [m].
        uv: Pixels of the lines on it, shape (2, n) [px].
        share: Of the stations that have a line on it, each counted the less the farther off it is,
            and all the less the farther off the ends are.
    """

    root: float
    sag: float
    sigma: float
    uv: Array
    share: float


def _shared_out(
    strips: list[_Strip | None], grey: np.ndarray, wanted: SightSettings
) -> dict[int, _Fit]:
    """Fits of the cables that are found, so that no line counts for two.

    The cable whose curve has lines at most of its stations takes them; the others that had some of
    these are fitted again without.
    """
    lines = {k: strip.lines(grey, wanted) for k, strip in enumerate(strips) if strip is not None}
    fits: dict[int, _Fit] = {}
    taken: dict[int, _Fit] = {}

    def look(k: int) -> None:
        strip = strips[k]
        assert strip is not None
        fit = strip.fit(*lines[k], wanted)
        fits.pop(k, None)
        if fit is not None:
            fits[k] = fit

    for k in lines:
        look(k)
    while fits:
        best = max(fits, key=lambda k: fits[k].share)
        taken[best] = fits.pop(best)
        for k in list(fits):
            strip = strips[k]
            assert strip is not None
            station, drop = lines[k]
            others = _near_points(strip.pixels(strip.x[station], drop), taken[best].uv, wanted)
            lines[k] = station[~others], drop[~others]
            if np.any(_near_points(fits[k].uv, taken[best].uv, wanted)):
                look(k)
    return taken


def _near_points(uv: Array, others: Array, wanted: SightSettings) -> np.ndarray:
    """Which pixels, shape (2, n), are on the curve through others, shape (2, k), shape (n,)."""
    start, step = others[:, :-1], np.diff(others, axis=1)
    along = np.sum(step * step, axis=0)
    rise = uv[:, :, np.newaxis] - start[:, np.newaxis]
    at = np.clip(np.sum(rise * step[:, np.newaxis], axis=0) / np.maximum(along, 1e-12), 0.0, 1.0)
    away = np.linalg.norm(rise - at * step[:, np.newaxis], axis=0)
    return np.asarray(np.min(away, axis=1, initial=np.inf) < wanted.near)


@dataclass(frozen=True)
class _Strip:
    """A part of a cable's vertical plane as an image has it.

    Attributes:
        start: The end it begins at, shape (3,) [m].
        out: Horizontal direction to the other end, shape (3,).
        span: Horizontal distance of the ends [m].
        rise: How much higher the other end is [m].
        camera: K R_EW and -K R_EW p_WE: pixels of points, shapes (3, 3) and (3,).
        x: Stations, shape (n,) [m].
        drops: Shape (k,) [m].
        across: Pixels across the line for a metre of drop, by station, shape (n,) [px/m].
        slant: Pixels for a metre across the line of sight over those, at both ends, shape (2,) [-]:
            an end that is off by a metre in any direction is off by so many metres of drop.
        moved: Both ends by poses that are off, shape (q, 2, 3), see `_moved_ends` [m].
    """

    start: Array
    out: Array
    span: float
    rise: float
    camera: tuple[Array, Array]
    x: Array
    drops: Array
    across: Array
    slant: Array
    moved: Array

    @staticmethod
    def of(
        start: Array, end: Array, X_WE: RigidTransform, pinhole: Pinhole, wanted: SightSettings,
        moved: Array,
    ) -> _Strip | None:  # fmt: skip
        """The strip of a cable; None where its sag could not be seen."""
        rise = end - start
        span = float(np.hypot(rise[0], rise[1]))
        if span < LEAST_SPAN:
            return None
        out = np.array([rise[0], rise[1], 0.0]) / span
        normal = np.array([-out[1], out[0], 0.0])
        R_EW = X_WE.rotation().matrix().T
        camera = pinhole.matrix() @ R_EW, -pinhole.matrix() @ R_EW @ X_WE.translation()
        coarse = _Strip(start, out, span, float(rise[2]), camera, *5 * (np.empty(0),))
        x = span * np.linspace(0.02, 0.98, 97)
        uv, down = coarse.pixels(x, np.zeros_like(x)), coarse.pixels(x, np.full_like(x, 1e-3))
        if not np.all(np.isfinite(uv)):
            return None
        sight = start[:, np.newaxis] + np.outer(out, x) - X_WE.translation()[:, np.newaxis]
        if np.min(np.abs(normal @ sight) / np.linalg.norm(sight, axis=0)) < LEAST_ANGLE:
            return None
        along = np.gradient(uv, axis=1)
        lengths = np.linalg.norm(along, axis=0)
        drop = (down - uv) / 1e-3
        across = np.abs(drop[0] * along[1] - drop[1] * along[0]) / lengths
        inside = pinhole_sees(pinhole, uv)
        if np.count_nonzero(inside) < 20 or np.any(across <= 0.0):
            return None
        count = int(np.clip(np.sum(lengths[inside]) / wanted.spacing, 12, 150))
        x = np.linspace(x[inside][0], x[inside][-1], count)
        spread = np.interp(x, span * np.linspace(0.02, 0.98, 97), across)
        size = np.linalg.norm(drop[:, len(drop[0]) // 2])
        chord = float(np.hypot(span, rise[2]))
        # A few pixels above the line, too: what is believed of the ends is a little off.
        depths = R_EW[2] @ sight[:, [0, -1]]
        slant = np.sqrt(pinhole.fx * pinhole.fy) / depths / across[[0, -1]]
        drops = np.arange(-6.0 * wanted.near / size, wanted.largest_sag * chord, wanted.step / size)
        return _Strip(start, out, span, float(rise[2]), camera, x, drops, spread, slant, moved)

    def pixels(self, x: Array, drop: Array) -> Array:
        """Pixels of points of the plane, shape (2, ...) [px]; NaN behind the camera."""
        M, t = self.camera
        at = self.start + x[..., np.newaxis] * self.out
        at[..., 2] += self.rise * x / self.span - drop
        p = at @ M.T + t
        z = np.where(p[..., 2] > 0.0, p[..., 2], np.nan)
        return np.array([p[..., 0] / z, p[..., 1] / z])

    def fit(self, station: np.ndarray, drop: Array, wanted: SightSettings) -> _Fit | None:
        """The curve that lines of `lines` are on; None: it is not there."""
        fits = [
            self._refined(station, drop, root, wanted)
            for root in self._likeliest(station, drop, wanted)
        ]
        good = [fit for fit in fits if fit is not None and fit.share >= wanted.share]
        return max(good, key=lambda fit: fit.share, default=None)

    def lines(self, grey: np.ndarray, wanted: SightSettings) -> tuple[np.ndarray, Array]:
        """Thin lines across the stations: which station, and at what drop [m]."""
        X, D = np.meshgrid(self.x, self.drops)
        uv = np.nan_to_num(self.pixels(X, D), nan=-1e4).astype(np.float32)
        strip = cv2.remap(
            grey, uv[0], uv[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=np.nan
        )
        # The filter is as wide in drops as a line is in the image, at each station's own scale.
        per_drop = float(np.median(self.across)) * (self.drops[1] - self.drops[0])
        width = wanted.line / max(per_drop, 1e-6)
        reach = int(np.ceil(4.0 * width))
        at = np.arange(-reach, reach + 1) / width
        kernel = (1.0 - at**2) * np.exp(-0.5 * at**2)
        kernel -= kernel.mean()
        kernel /= np.sum(np.abs(kernel)) / 2.0
        good = np.isfinite(strip)
        # Of a line darker than both sides only: beside it, one of the other sign responds less.
        plain = np.where(good, strip, 0.0).astype(float)
        response = -cv2.filter2D(plain, cv2.CV_64F, kernel[:, np.newaxis])
        whole = cv2.erode(good.astype(np.uint8), np.ones((2 * reach + 1, 1), np.uint8)) > 0
        response[~whole] = 0.0
        noise = (
            float(np.median(np.abs(response[whole]))) / MEDIAN_SHARE if np.any(whole) else np.inf
        )
        least = max(wanted.contrast * noise, wanted.levels)
        middle = response[1:-1]
        peak = (middle > least) & (middle >= response[:-2]) & (middle > response[2:])
        row, station = np.nonzero(peak)
        before, here, after = (response[row + k, station] for k in range(3))
        bend = before - 2.0 * here + after
        offset = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, 1.0), 0.0)
        step = self.drops[1] - self.drops[0]
        return station, self.drops[0] + (row + 1 + offset) * step

    def _likeliest(self, station: np.ndarray, drop: Array, wanted: SightSettings) -> list[float]:
        """Roots of the surplus of catenaries that many stations have a line near to [m^0.5]: other
        cables cross the strip, so the most is not always the right one."""
        near = 2.0 * wanted.near / float(np.median(self.across))
        roots = np.arange(0.0, self.drops[-1], 0.5 * near) / drop_per_root(self.span, self.rise)
        counts = np.zeros(len(roots))
        for k, root in enumerate(roots):
            on = np.abs(drop - self.curve(root)[station]) < near
            counts[k] = len(np.unique(station[on]))
        found: list[float] = []
        while len(found) < HYPOTHESES and np.max(counts) >= wanted.share * len(self.x):
            best = int(np.argmax(counts))
            found.append(float(roots[best]))
            counts[max(best - 3, 0) : best + 4] = 0.0
        return found

    def curve(self, root: float, x: Array | None = None) -> Array:
        """Drops of the catenary of a surplus, by its root [m^0.5], at stations [m]; by a negative
        root it lies above the line as far as by a positive one below."""
        at = self.x if x is None else x
        return np.sign(root) * catenary_drop(at, self.span, self.rise, root**2)

    def _pose_rows(self, root: float) -> tuple[Array, Array]:
        """What the curve of a root does where the pose is off by a standard deviation along each
        direction: drops at the stations, shape (n, q), and sags, shape (q,) [m].

        The curve moves in the image with both its ends, along itself, too: what counts is how far
        it moves across itself there.
        """
        base = self.pixels(self.x, self.curve(root))
        tangent = np.gradient(base, axis=1)
        normal = np.array([-tangent[1], tangent[0]])
        down = self.pixels(self.x, self.curve(root) + SMALL_DROP) - base
        per_drop = np.sum(down * normal, axis=0) / SMALL_DROP
        flat = np.abs(per_drop) < 1e-6 * np.linalg.norm(normal, axis=0)
        middle = float(self.curve(root, np.array([0.5 * self.span]))[0])
        rows, sags = np.zeros((len(self.x), len(self.moved))), np.zeros(len(self.moved))
        for k, (start, end) in enumerate(self.moved):
            rise = end - start
            span = float(np.hypot(rise[0], rise[1]))
            out = np.array([rise[0], rise[1], 0.0]) / span
            other = replace(self, start=start, out=out, span=span, rise=float(rise[2]))
            x = self.x * span / self.span
            off = np.sum((other.pixels(x, other.curve(root, x)) - base) * normal, axis=0)
            rows[:, k] = np.where(flat, 0.0, off / np.where(flat, 1.0, per_drop))
            sags[k] = float(other.curve(root, np.array([0.5 * span]))[0]) - middle
        return rows, sags

    def _refined(
        self, station: np.ndarray, drop: Array, root: float, wanted: SightSettings
    ) -> _Fit | None:
        """The fit of both ends, the root of the surplus [m^0.5], and how far the pose is off, in
        standard deviations, to lines near the curve, by Gauss and Newton, with Cauchy's weights."""
        t, (of_pose, of_sag) = self.x / self.span, self._pose_rows(root)
        size, q = np.inf, len(of_sag)
        state, normal = np.concatenate([[0.0, 0.0, root], np.zeros(q)]), np.eye(3 + q)
        chosen = np.zeros(0, int)
        for _ in range(FITS):
            curve = state[0] * (1.0 - t) + state[1] * t + self.curve(state[2])
            curve = curve + of_pose @ state[3:]
            off = (drop - curve[station]) * self.across[station]
            chosen = _nearest(station, off, 2.0 * wanted.near)
            if len(chosen) < wanted.share * len(self.x):
                return None
            at = station[chosen]
            slope = (self.curve(state[2] + STEP) - self.curve(state[2] - STEP)) / (2.0 * STEP)
            # Pixels across the line for both ends, the root, and the pose.
            J = np.column_stack([1.0 - t[at], t[at], slope[at], of_pose[at]])
            J *= self.across[at][:, np.newaxis]
            size = max(float(np.median(np.abs(off[chosen]))) / MEDIAN_SHARE, LEAST_NOISE)
            weight = np.sqrt(1.0 / (1.0 + (off[chosen] / (CAUCHY * size)) ** 2))
            size *= np.sqrt(_repeated(at, off[chosen] * weight))
            prior = np.zeros((2 + q, 3 + q))
            prior[[0, 1], [0, 1]] = size / (wanted.ends * self.slant)
            prior[range(2, 2 + q), range(3, 3 + q)] = size
            A = np.vstack([J * weight[:, np.newaxis], prior])
            b = np.concatenate([off[chosen] * weight, -prior @ state])
            normal = np.linalg.inv(A.T @ A)
            change = normal @ (A.T @ b)
            state = state + change
            if abs(change[2]) < 1e-7:
                break
        middle = np.array([0.5 * self.span])
        here, there = (float(self.curve(state[2] + k * STEP, middle)[0]) for k in (0.0, 1.0))
        per_state = np.concatenate([[0.0, 0.0, (there - here) / STEP], of_sag])
        sigma = size * np.sqrt(per_state @ normal @ per_state)
        uv = self.pixels(self.x[station[chosen]], drop[chosen])
        weights = 1.0 / (1.0 + (off[chosen] / wanted.noise) ** 2)
        # Another cable's line may be as long and as smooth, but ends elsewhere.
        far = float(np.max(np.abs(state[:2]) / self.slant)) / wanted.ends
        far = max(far, float(np.max(np.abs(state[3:]), initial=0.0)))
        share = float(np.sum(weights)) / len(self.x) / (1.0 + (far / FAR) ** 4)
        sag = here + float(of_sag @ state[3:])
        return _Fit(float(state[2]), sag, float(sigma), uv, share)


def _repeated(station: np.ndarray, off: Array) -> float:
    """How many residuals, in the order of their stations, count as one; 1 where they are
    independent.

    Lines are made out from pixels that neighbouring stations share, but no others: by the
    correlation c of neighbours a smooth curve through many is known as through 1 / (1 + 2 c) of
    them, and c of such a process is at most 1 / 2.
    """
    order = np.argsort(station)
    at, r = station[order], off[order] - np.mean(off)
    near, power = np.diff(at) == 1, float(np.mean(r * r))
    if np.count_nonzero(near) < LEAST_PAIRS or power == 0.0:
        return 1.0
    c = float(np.mean((r[:-1] * r[1:])[near])) / power
    return 1.0 + 2.0 * min(max(c, 0.0), MOST_CORRELATED)


LEAST_PAIRS = 8
"""Pairs of neighbouring stations of which a correlation is taken."""

MOST_CORRELATED = 0.5
"""Correlation of neighbours where those farther off are independent, at most."""

SMALL_DROP = 1e-4
"""Of derivatives by drops [m]."""

HYPOTHESES = 6
"""Curves of a cable that are fitted, of which the best counts."""

FAR = 4.0
"""Error of an end, in standard deviations, by which a curve counts half."""

IMPOSSIBLE = 4.0
"""Standard deviations of a sag by which it may be below zero by chance."""

FITS = 15
"""Of Gauss and Newton's method, which chooses its points anew each time."""

STEP = 1e-5
"""Of derivatives by the root of the surplus [m^0.5]."""

CAUCHY = 2.385
"""Of residuals, in standard deviations, whose weight is a half: 95 % efficient for normal ones."""

MEDIAN_SHARE = 0.6745
"""Median of the absolute value of a normal number, of its standard deviation."""

LEAST_NOISE = 0.05
"""Of a line's place in the image at least [px]: residuals of few may be smaller by chance."""


def _nearest(station: np.ndarray, off: Array, near: float) -> np.ndarray:
    """Of each station the line nearest to the curve, if one is near; indices."""
    order = np.lexsort((np.abs(off), station))
    first = np.concatenate([[True], np.diff(station[order]) > 0])
    chosen = order[first]
    return chosen[np.abs(off[chosen]) < near]


def pinhole_sees(pinhole: Pinhole, uv: Array) -> np.ndarray:
    """Which pixels, shape (2, n) [px], lie in the image, shape (n,)."""
    inside = (uv[0] >= 0.0) & (uv[0] <= pinhole.width - 1.0)
    return np.asarray(inside & (uv[1] >= 0.0) & (uv[1] <= pinhole.height - 1.0))
