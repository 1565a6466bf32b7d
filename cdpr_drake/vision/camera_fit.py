"""Which camera took images of a board: intrinsic parameters and lens, by OpenCV's calibration.

Some images are held out of the fit: how the fitted camera explains those, after their board's pose
was found, says what it is worth beyond the images that it was fitted to. Images that fit far worse
than the others are named and, unless they shall stay, left out of a second fit.

Standard deviations are those of linear least squares at the solution, with the noise that the
residuals have: what a lens model cannot show is not in them. Blur and the search for corners draw
all corners of tags inwards by as much: that growth is a parameter of the fit, and is taken out.
What is left of one tag's corners goes together: their residuals are added up before squares, each
tag's over what a fit leaves of its errors.

Source: Zhang, IEEE TPAMI 22(11), 2000; OpenCV, modules calib3d and fisheye; Liang, Zeger,
Longitudinal data analysis using generalized linear models, 1986, for corners that go together.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CameraCalibrationError, accepted_names
from cdpr_drake.vision.lens_distortion import COEFFICIENTS, NO_LENS, LensDistortion
from cdpr_drake.vision.pinhole import Pinhole

FEWEST_VIEWS = 5
"""Images with a board that a fit needs."""

HOLD_OUT = 0.2
"""Share of the images that are held out, where nothing is said."""

FEWEST_HELD = 8
"""Images from which on some are held out."""

OUTLIER = 3.0
"""An image whose rms is so many times the median is an outlier."""

LEAST_OUTLIER = 0.3
"""And no image below this rms [px]: detection does not do much better."""

CORNER_OUTLIER, MOST_CORNERS, MOST_CLEANINGS = 4.0, 0.2, 4
"""A corner that is so many standard deviations of all corners off is left out, where no more than
this share of its image is; and how often the rest is fitted again."""

GROWTHS = 3
"""How often tags are fitted, each time with the growth that the time before has shown."""

NOTHING = 1e-9
"""Share of an error that a fit leaves, from which on it leaves none."""

LEAST_TILT = 12.0
"""Angle between two boards of a fit, at least [deg]: of parallel ones the distance and the focal
length are one."""

LOOSEST = 0.05
"""Standard deviation of a focal length, per its value, from which on it is not told."""

CELLS = (8, 6)
"""Columns and rows of the cells in which corners should lie all over an image."""

RATIONAL = "rational"
MODELS = ("brown_conrady", RATIONAL, "fisheye", NO_LENS)
"""Lenses that are fitted; rational is brown_conrady with k4 to k6."""

_FREE = {"brown_conrady": 5, RATIONAL: 8, "fisheye": 4, NO_LENS: 0}


class View(NamedTuple):
    """A board in an image: its name, corners on the board, (n, 3) [m], and in the image, (n, 2)
    [px]; how many that follow each other are off together, as those of one tag."""

    name: str
    points: Array
    uv: Array
    together: int = 1

    def outward(self) -> Array:
        """Directions from the middle of its tag to each corner, shape (n, 2)."""
        tags = self.uv.reshape(-1, self.together, 2)
        away = tags - np.mean(tags, axis=1, keepdims=True)
        return (away / np.linalg.norm(away, axis=2, keepdims=True)).reshape(-1, 2)

    def grown(self, growth: float) -> View:
        """The view with corners moved outwards [px]."""
        return self._replace(uv=self.uv + growth * self.outward()) if growth else self

    def without(self, residuals: Array, most: float) -> View:
        """The view without corners that are off by more than `most` [px]; itself where many are.

        Args:
            residuals: Of its corners, shape (n, 2) [px].
            most: As above.
        """
        off = np.linalg.norm(residuals, axis=1).reshape(-1, self.together).max(axis=1) > most
        if not off.any() or np.mean(off) > MOST_CORNERS:
            return self
        keep = np.repeat(~off, self.together)
        return self._replace(points=self.points[keep], uv=self.uv[keep])


@dataclass(frozen=True)
class ViewFit:
    """How a view fits.

    Attributes:
        name: The image.
        rms: Root of the mean squared distance of its corners from where they should be [px].
        role: "fitted", "held out" or "outlier", which was left out.
        residuals: Of its corners, shape (n, 2) [px].
        uv: Its corners, shape (n, 2) [px].
    """

    name: str
    rms: float
    role: str
    residuals: Array
    uv: Array


@dataclass(frozen=True)
class CameraFit:
    """A camera that was fitted.

    Attributes:
        camera: The camera and its lens.
        model: One of `MODELS`.
        names: Of the parameters: fx, fy, cx, cy, then coefficients.
        values: Of the parameters.
        deviations: Their standard deviations.
        views: How each view fits.
        coverage: Share of the cells of the image in which fitted corners lie [-].
        reach: Distance of the farthest fitted corner from the middle, per half diagonal [-].
        tilt: Largest angle between two fitted boards [rad].
        left_out: Corners that are in no view's residuals, since they are off by far more.
        growth: By how much corners of tags were seen farther from their middle than they are [px].
    """

    camera: Pinhole
    model: str
    names: tuple[str, ...]
    values: Array
    deviations: Array
    views: tuple[ViewFit, ...]
    coverage: float
    reach: float
    tilt: float
    left_out: int = 0
    growth: float = 0.0

    def rms(self, role: str) -> float:
        """Of all corners of views of a role [px]; NaN where there are none."""
        parts = [view.residuals for view in self.views if view.role == role]
        if not parts:
            return float("nan")
        return float(np.sqrt(np.mean(np.sum(np.concatenate(parts) ** 2, axis=1))))


@contextmanager
def _one_thread() -> Iterator[None]:
    """OpenCV in one thread: in several it adds up in any order, and no fit comes back twice."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


def fit_camera(
    views: Sequence[View],
    size: tuple[int, int],
    model: str = "brown_conrady",
    *,
    hold_out: float = HOLD_OUT,
    keep_outliers: bool = False,
) -> CameraFit:
    """The camera that took images of a board.

    Args:
        views: The board in each image.
        size: Width and height of the images [px].
        model: One of `MODELS`.
        hold_out: Share of the images that are compared only.
        keep_outliers: Whether images and corners that fit badly count.

    Raises:
        CameraCalibrationError: There are too few views, or they do not tell the camera; names why.
    """
    if model not in MODELS:
        raise CameraCalibrationError(f"model: found {model!r}; {accepted_names(model, MODELS)}")
    if not 0.0 <= hold_out <= 0.5:
        raise CameraCalibrationError(f"hold_out: found {hold_out:g}; accepted: 0 to 0.5")
    if len(views) < FEWEST_VIEWS:
        raise CameraCalibrationError(
            f"images: found the board in {len(views)}; accepted: at least {FEWEST_VIEWS}"
        )
    count = round(hold_out * len(views)) if len(views) >= FEWEST_HELD else 0
    # Evenly among the images, which often come in the order of the board's ways.
    held = set(np.linspace(0, len(views) - 1, count + 2)[1:-1].round().astype(int)) if count else ()
    used = [k for k in range(len(views)) if k not in held]
    every, views = sum(len(view.uv) for view in views), list(views)
    fit = _fit([views[k] for k in used], size, model)
    most = np.inf
    for _ in range(0 if keep_outliers else MOST_CLEANINGS):
        most = CORNER_OUTLIER * 1.4826 * float(np.median(np.abs(np.concatenate(fit.residuals))))
        before = sum(len(one) for one in fit.residuals)
        for k, residuals in zip(used, fit.residuals, strict=True):
            views[k] = views[k].without(residuals, most)
        if sum(len(views[k].uv) for k in used) == before:
            break
        fit = _fit([views[k] for k in used], size, model)
    for k in held:
        views[k] = views[k].without(_residuals_at_best(views[k], fit), most)
    worst = max(OUTLIER * float(np.median(fit.rms)), LEAST_OUTLIER)
    good = [k for k, rms in zip(used, fit.rms, strict=True) if rms <= worst or keep_outliers]
    if len(good) < len(used):
        if len(good) < FEWEST_VIEWS:
            bad = ", ".join(views[k].name for k in used if k not in good)
            raise CameraCalibrationError(
                f"images: found {len(good)} that fit one camera, beside {bad}; accepted: at least "
                f"{FEWEST_VIEWS}"
            )
        fit = _fit([views[k] for k in good], size, model)
    _refuse_loose(fit)
    camera = fit.camera(size)
    told = []
    for k, view in enumerate(views):
        if k in good:
            residuals, role = fit.residuals[good.index(k)], "fitted"
        else:
            role = "held out" if k in held else "outlier"
            residuals = _residuals_at_best(view, fit)
        rms = float(np.sqrt(np.mean(np.sum(residuals**2, axis=1))))
        told.append(ViewFit(view.name, rms, role, residuals, view.uv))
    corners = np.concatenate([views[k].uv for k in good])
    cells = np.floor((corners + 0.5) / np.array(size) * CELLS).astype(int)
    middle = 0.5 * np.array(size) - 0.5
    reach = np.max(np.linalg.norm(corners - middle, axis=1)) / np.linalg.norm(0.5 * np.array(size))
    kind = "brown_conrady" if model == RATIONAL else model
    names = ("fx", "fy", "cx", "cy", *COEFFICIENTS.get(kind, ())[: _FREE[model]])
    return CameraFit(
        camera, model, names, fit.values, fit.deviations, tuple(told),
        len({tuple(cell) for cell in cells}) / (CELLS[0] * CELLS[1]), float(reach), fit.tilt,
        every - sum(len(view.uv) for view in views), fit.growth,
    )  # fmt: skip


class _Fit(NamedTuple):
    """What OpenCV found: parameters, deviations, how views fit, and how much tags grew [px]."""

    model: str
    values: Array
    deviations: Array
    residuals: list[Array]
    tilt: float
    growth: float

    @property
    def rms(self) -> list[float]:
        return [float(np.sqrt(np.mean(np.sum(one**2, axis=1)))) for one in self.residuals]

    def matrix(self) -> Array:
        fx, fy, cx, cy = self.values[:4]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def camera(self, size: tuple[int, int]) -> Pinhole:
        fx, fy, cx, cy = (float(value) for value in self.values[:4])
        kind = "brown_conrady" if self.model == RATIONAL else self.model
        lens = tuple(float(value) for value in self.values[4:])
        distortion = None if kind == NO_LENS else LensDistortion(kind, lens)
        return Pinhole(size[0], size[1], fx, fy, cx, cy, distortion)


@_one_thread()
def _fit(views: Sequence[View], size: tuple[int, int], model: str) -> _Fit:
    fisheye, groups, growth = model == "fisheye", [view.together for view in views], 0.0
    tags = max(groups) > 1
    for _ in range(GROWTHS if tags else 1):
        grown = [view.grown(-growth) for view in views]
        try:
            found = _fisheye(grown, size) if fisheye else _brown_conrady(grown, size, model)
        except cv2.error as problem:
            why = str(problem.err or problem).strip().splitlines()[0]
            raise CameraCalibrationError(
                f"images: found {len(views)} from which OpenCV finds no camera with a lens of "
                f"model {model} ({why}); accepted: boards tilted in several ways, or another model"
            ) from problem
        values, turns, moves = found
        residuals, J, extrinsic = [], [], []
        for view, r, p in zip(grown, turns, moves, strict=True):
            uv, mine, pose = _project(view.points, r, p, values, fisheye)
            residuals.append(uv - view.uv)
            J.append(np.column_stack([mine, view.outward().ravel()]) if tags else mine)
            extrinsic.append(pose)
        step, deviations = _linear_fit(J, extrinsic, residuals, groups)
        growth += float(step[-1]) if tags else 0.0
    normals = np.array([cv2.Rodrigues(r)[0][:, 2] for r in turns])
    tilt = float(np.arccos(np.clip(np.min(normals @ normals.T), -1.0, 1.0)))
    if np.degrees(tilt) < LEAST_TILT:
        raise CameraCalibrationError(
            f"images: found boards that are within {np.degrees(tilt):.1f} deg of parallel, of "
            "which distance and focal length are one; accepted: boards tilted by "
            f"{LEAST_TILT:g} deg and more against each other"
        )
    return _Fit(model, values, deviations[: len(values)], residuals, tilt, growth)


def _brown_conrady(
    views: Sequence[View], size: tuple[int, int], model: str
) -> tuple[Array, Sequence[Array], Sequence[Array]]:
    flags = {
        NO_LENS: cv2.CALIB_ZERO_TANGENT_DIST + cv2.CALIB_FIX_K1 + cv2.CALIB_FIX_K2
        + cv2.CALIB_FIX_K3, RATIONAL: cv2.CALIB_RATIONAL_MODEL,
    }.get(model, 0)  # fmt: skip
    points = [view.points.astype(np.float32) for view in views]
    uv = [view.uv.astype(np.float32) for view in views]
    _, K, lens, turns, moves, _, _, _ = cv2.calibrateCameraExtended(
        points, uv, size, None, None, flags=flags
    )
    values = [K[0, 0], K[1, 1], K[0, 2], K[1, 2], *np.ravel(lens)[: _FREE[model]]]
    return np.array(values), turns, moves


def _fisheye(
    views: Sequence[View], size: tuple[int, int]
) -> tuple[Array, Sequence[Array], Sequence[Array]]:
    points = [view.points.reshape(1, -1, 3) for view in views]
    uv = [view.uv.reshape(1, -1, 2) for view in views]
    K, lens = np.eye(3), np.zeros((4, 1))
    # OpenCV 5 moved its flags, and gave them other numbers.
    place = cv2.fisheye if hasattr(cv2.fisheye, "CALIB_FIX_SKEW") else cv2
    flags = place.CALIB_RECOMPUTE_EXTRINSIC + place.CALIB_FIX_SKEW
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-10)
    _, K, lens, turns, moves = cv2.fisheye.calibrate(
        points, uv, size, K, lens, flags=flags, criteria=criteria
    )
    values = [K[0, 0], K[1, 1], K[0, 2], K[1, 2], *np.ravel(lens)]
    return np.array(values), turns, moves


def _project(
    points: Array, r: Array, p: Array, values: Array, fisheye: bool
) -> tuple[Array, Array, Array]:
    """Images of points [px], their derivatives by the parameters, and by rotation and position."""
    K = np.array([[values[0], 0.0, values[2]], [0.0, values[1], values[3]], [0.0, 0.0, 1.0]])
    r, p = np.asarray(r, float).reshape(3, 1), np.asarray(p, float).reshape(3, 1)
    free = len(values) - 4
    if fisheye:
        uv, J = cv2.fisheye.projectPoints(points.reshape(-1, 1, 3), r, p, K, values[4:])
        return uv.reshape(-1, 2), J[:, : 4 + free], J[:, 8:14]
    lens = np.zeros(8)
    lens[:free] = values[4:]
    uv, J = cv2.projectPoints(points, r, p, K, lens)
    return uv.reshape(-1, 2), J[:, 6 : 10 + free], J[:, :6]


def _linear_fit(
    J: list[Array], extrinsic: list[Array], residuals: list[Array], together: list[int]
) -> tuple[Array, Array]:
    """How parameters change in linear least squares, poses of boards left free, and deviations.

    Deviations are as those of `cv2.calibrateCameraExtended`, which OpenCV does not give of a
    fisheye. Where corners go together, with the rows F of N = F'F and residuals r of a tag, the
    covariance is N^-1 sum(g g') N^-1 with g = F' (I - H)^(-1/2) r: of independent errors r has the
    share I - H, H the tag's part of the hat matrix.

    Source: Bell, McCaffrey, Bias reduction in standard errors for linear regression with
    multi-stage samples, 2002.
    """
    size = J[0].shape[1]
    free = [
        mine - pose @ np.linalg.solve(pose.T @ pose, pose.T @ mine)
        for mine, pose in zip(J, extrinsic, strict=True)
    ]
    A, r = np.concatenate(free), np.concatenate(residuals).ravel()
    back = np.linalg.pinv(A.T @ A, hermitian=True)
    if max(together) == 1:
        covariance = float(r @ r) / max(len(r) - size - 6 * len(J), 1) * back
    else:
        M = np.zeros((size, size))
        for mine, pose, one, group in zip(free, extrinsic, residuals, together, strict=True):
            F = mine.reshape(-1, 2 * group, size)
            Q = np.linalg.qr(pose)[0].reshape(-1, 2 * group, 6)
            rest = np.eye(2 * group) - Q @ Q.transpose(0, 2, 1) - F @ back @ F.transpose(0, 2, 1)
            shares, V = np.linalg.eigh(rest)
            parts = V.transpose(0, 2, 1) @ one.reshape(-1, 2 * group, 1)
            g = (
                F.transpose(0, 2, 1)
                @ V
                @ (parts / np.sqrt(np.maximum(shares, NOTHING))[..., np.newaxis])
            )[..., 0]
            M += g.T @ g
        covariance = back @ M @ back
    return -back @ A.T @ r, np.sqrt(np.diag(covariance))


def _refuse_loose(fit: _Fit) -> None:
    """Refuses a focal length that the views do not tell.

    Raises:
        CameraCalibrationError: It is so.
    """
    loose = fit.deviations[:2] / np.abs(fit.values[:2])
    if not np.all(loose < LOOSEST):
        raise CameraCalibrationError(
            f"images: found a focal length of {fit.values[0]:.4g} px with a standard deviation of "
            f"{100.0 * float(np.max(loose)):.2g} %; accepted: below {100.0 * LOOSEST:g} %, by more "
            "boards, tilted and near enough to show perspective"
        )


def _residuals_at_best(view: View, fit: _Fit) -> Array:
    """Residuals of a view that was not fitted, with its board where it fits best, shape (n, 2)
    [px]."""
    view = view.grown(-fit.growth)
    fisheye, K = fit.model == "fisheye", fit.matrix()
    lens = fit.camera((1, 1)).distortion
    xy = (view.uv.T - K[:2, 2:]) / np.diag(K)[:2, np.newaxis]
    if lens is not None:
        xy = lens.undistort(xy)
    if not np.all(np.isfinite(xy)):
        return np.full(view.uv.shape, np.inf)
    flat = view.points.reshape(-1, 1, 3)
    _, r, p = cv2.solvePnP(flat, xy.T.reshape(-1, 1, 2), np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    x = np.concatenate([np.ravel(r), np.ravel(p)])
    for _ in range(20):  # Gauss and Newton in pixels, from a start that is nearly there
        uv, _, pose = _project(view.points, x[:3], x[3:], fit.values, fisheye)
        step = np.linalg.lstsq(pose, (view.uv - uv).ravel(), rcond=None)[0]
        x = x + step
        if np.linalg.norm(step) < 1e-12:
            break
    return _project(view.points, x[:3], x[3:], fit.values, fisheye)[0] - view.uv
