"""Cameras from images of boards, against cameras that are known: OpenCV's projection and boards."""

from functools import cache

import cv2
import numpy as np
import pytest

from cdpr_drake.vision.camera_fit import View, fit_camera
from tests.vision.boards import board_image, board_poses, lit, make_board

SIGMAS = 3.5
"""Errors over their standard deviations, the largest of nine: 3 is passed by one in forty such
sets, 3.5 by one in 240."""
IMAGE_FOCAL = 0.004
"""Share of a focal length by which detection in drawn images may be off: a tenth of a pixel of 40
of a square; 0.002 was measured."""
IMAGE_CENTRE = 1.5  # [px] of the principal point from drawn images; 0.4 was measured
HONEST, LARGEST = (0.8, 1.3), 4.0  # rms, and the largest, of errors over their deviations

SIZE = (640, 480)
K = np.array([[520.0, 0.0, 331.2], [0.0, 518.0, 236.4], [0.0, 0.0, 1.0]])
LENSES = {
    "none": np.zeros(0),
    "brown_conrady": np.array([-0.28, 0.09, 0.0012, -0.0008, 0.0]),
    "fisheye": np.array([-0.03, 0.006, -0.002, 1e-4]),
}
KINDS = ["charuco", "tags", "chessboard"]


def projected(name, count=20, noise=0.1, poses=None):
    """Corners of a board as OpenCV projects them, with noise; those in the image."""
    board = make_board("chessboard")
    y, x = np.mgrid[: board.rows - 1, : board.columns - 1]
    points = board.size * np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    project = cv2.fisheye.projectPoints if name == "fisheye" else cv2.projectPoints
    random, views = np.random.default_rng(7), []
    for k, (R, p) in enumerate(poses or board_poses(board, count, 0.42)):
        uv = project(points.reshape(-1, 1, 3), cv2.Rodrigues(R)[0], p, K, LENSES[name])[0]
        uv = uv.reshape(-1, 2) + noise * random.standard_normal((len(points), 2))
        seen = np.all((uv > 0.0) & (uv < np.array(SIZE) - 1.0), axis=1)
        if np.count_nonzero(seen) >= 20:
            views.append(View(f"image {k}", points[seen], uv[seen]))
    return views


def flat():
    """Boards that all face the camera."""
    shifts = [(-0.1, -0.05), (0.05, 0.02), (-0.15, -0.1), (0.0, 0.0), (-0.1, 0.0), (-0.05, -0.08)]
    return [(np.eye(3), np.array([x - 0.05, y - 0.05, 0.5 + 0.1 * x])) for x, y in shifts]


@cache
def fitted(name):
    return fit_camera(projected(name), SIZE, name)


def sigmas(fit, name):
    truth = np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], *LENSES[name]])
    return np.abs((fit.values - truth) / fit.deviations)


def names(fit, role):
    return [view.name for view in fit.views if view.role == role]


def fitted_view(views):
    """Number of the first that is not held out."""
    held = names(fitted("brown_conrady"), "held out")
    return next(k for k, view in enumerate(views) if view.name not in held)


@pytest.mark.parametrize("name", LENSES)
def test_a_known_camera_comes_back_within_its_standard_deviations(name):
    fit = fitted(name)
    assert np.max(sigmas(fit, name)) < SIGMAS
    assert len(fit.names) == len(fit.values)
    # Noise of 0.1 px along each axis is 0.14 px of distance; poses take a little of it.
    assert fit.rms("fitted") == pytest.approx(0.1 * np.sqrt(2.0), rel=0.1)
    assert fit.rms("held out") == pytest.approx(0.1 * np.sqrt(2.0), rel=0.15)


def test_standard_deviations_are_those_of_opencv():
    views = projected("brown_conrady")
    fit = fit_camera(views, SIZE, hold_out=0.0)
    deviations = cv2.calibrateCameraExtended(
        [v.points.astype(np.float32) for v in views], [v.uv.astype(np.float32) for v in views],
        SIZE, None, None,
    )[5].ravel()[:9]  # fmt: skip
    np.testing.assert_allclose(fit.deviations, deviations, rtol=0.02)


def alone(view, random):
    return view._replace(uv=view.uv + 0.1 * random.standard_normal(view.uv.shape))


def in_fours(view, random):
    """Each four that follow each other have one error, which the single corners' scatter hides."""
    n = len(view.uv) // 4 * 4
    shared = np.repeat(0.1 * random.standard_normal((n // 4, 2)), 4, axis=0)
    return View(view.name, view.points[:n], view.uv[:n] + shared, 4)


@pytest.mark.parametrize(("name", "noisy"), [("fisheye", alone), ("none", in_fours)])
def test_standard_deviations_are_those_of_many_fits(name, noisy):
    """Of a fisheye OpenCV has none; the spread over noise is what they say."""
    exact, fits = projected(name, count=10, noise=0.0), []
    for seed in range(12):
        random = np.random.default_rng(seed)
        fits.append(fit_camera([noisy(v, random) for v in exact], SIZE, name, hold_out=0.0))
    spread = np.std([fit.values for fit in fits], axis=0, ddof=1)
    stated = np.mean([fit.deviations for fit in fits], axis=0)
    assert np.all((spread / stated > 0.5) & (spread / stated < 1.7))


def test_held_out_images_are_evenly_chosen_and_not_fitted():
    views, fit = projected("brown_conrady"), fitted("brown_conrady")
    held = names(fit, "held out")
    assert len(held) == round(0.2 * len(views))
    shifted = [v._replace(uv=v.uv + 25.0) if v.name in held else v for v in views]
    np.testing.assert_array_equal(fit_camera(shifted, SIZE).values, fit.values)


@pytest.mark.parametrize("model", ["brown_conrady", "fisheye"])
def test_a_fit_comes_back_to_the_bit_and_leaves_threads_as_they_were(model):
    threads = cv2.getNumThreads()
    cv2.setNumThreads(2)
    try:
        fits = [fit_camera(projected(model), SIZE, model) for _ in range(2)]
        assert cv2.getNumThreads() == 2
    finally:
        cv2.setNumThreads(threads)
    for fit in fits:
        np.testing.assert_array_equal(fit.values, fitted(model).values)
        np.testing.assert_array_equal(fit.deviations, fitted(model).deviations)


def test_an_image_that_fits_far_worse_is_named_and_left_out():
    views = projected("brown_conrady")
    bad = fitted_view(views)
    wrong = 4.0 * np.random.default_rng(2).standard_normal(views[bad].uv.shape)
    views[bad] = views[bad]._replace(uv=views[bad].uv + wrong)
    fit = fit_camera(views, SIZE)
    assert names(fit, "outlier") == [views[bad].name]
    assert np.max(sigmas(fit, "brown_conrady")) < SIGMAS
    with_it = fit_camera(views, SIZE, keep_outliers=True)
    assert not names(with_it, "outlier")
    assert with_it.rms("fitted") > 3.0 * fit.rms("fitted")


def test_a_corner_that_is_off_is_left_out_and_counted():
    views = projected("brown_conrady")
    bad = views[fitted_view(views)]
    bad.uv[3] += 2.0
    fit = fit_camera(views, SIZE)
    assert fit.left_out >= 1
    assert len(next(v for v in fit.views if v.name == bad.name).uv) < len(bad.uv)
    assert np.max(sigmas(fit, "brown_conrady")) < SIGMAS
    assert fit_camera(views, SIZE, keep_outliers=True).left_out == 0


@pytest.mark.parametrize("kind", KINDS)
def test_drawn_images_give_the_camera_that_drew_them(kind):
    board, views, lens = make_board(kind), [], LENSES["brown_conrady"]
    assert board.find(np.full((240, 320), 200, np.uint8)) is None
    for k, pose in enumerate(board_poses(board, 9, 0.45, spread=0.35)):
        found = board.find(board_image(board, K, lens, SIZE, pose))
        if found is not None:
            views.append(View(str(k), *found))
    assert len(views) >= 5
    fit = fit_camera(views, SIZE, hold_out=0.0)
    np.testing.assert_allclose(fit.values[:2], np.diag(K)[:2], rtol=IMAGE_FOCAL)
    np.testing.assert_allclose(fit.values[2:4], K[:2, 2], rtol=0.0, atol=IMAGE_CENTRE)


LIGHTS = {  # greys of black and white, noise and blur, and the wall behind the board
    "bright": ((20, 235, 1.5, 0.0), 170), "dark wall": ((40, 140, 1.5, 0.7), 0),
    "dim": ((10, 50, 0.7, 0.7), 60), "glare": ((110, 255, 1.5, 1.2), 255),
    "flat": ((100, 150, 1.0, 0.0), 100),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_boards_are_found_in_any_light_and_deviations_are_the_real_ones(kind):
    """Two cameras a light: 40 errors, whose root mean square scatters by a ninth."""
    board, off, plain = make_board(kind), [], np.zeros(5)
    for number, (light, wall) in enumerate(2 * list(LIGHTS.values())):
        views = []
        for k, pose in enumerate(board_poses(board, 5, 0.55, seed=40 + number, spread=0.2)):
            image = board_image(board, K, plain, SIZE, pose, wall=wall)
            found = board.find(lit(image, light, [number, k]))
            assert found is not None, (number, k)
            views.append(View(str(k), *found, board.together))
        off.append(sigmas(fit_camera(views, SIZE, "none", hold_out=0.0), "none"))
    assert HONEST[0] < float(np.sqrt(np.mean(np.square(off)))) < HONEST[1]
    assert np.max(off) < LARGEST
