"""Images of boards by a known camera, drawn by OpenCV alone: its boards, its inverse of a lens."""

from functools import lru_cache

import cv2
import numpy as np

from cdpr_drake.vision.calibration_boards import CHARUCO, CHESSBOARD, CalibrationBoard

FINE = 2
"""Samples along a pixel."""

PER_SQUARE = 60
"""Pixels along a square of a board's own picture."""


def board_picture(board):
    """The board as it is printed, and what places it: pixels per metre, and its corner [px]."""
    if board.kind == CHESSBOARD:
        size = (board.rows * PER_SQUARE, board.columns * PER_SQUARE)
        v, u = np.mgrid[: size[0], : size[1]] // PER_SQUARE
        picture = np.where((u + v) % 2 == 0, 0, 255).astype(np.uint8)
        # The first corner between squares is the board's origin.
        corner = np.array([PER_SQUARE, PER_SQUARE])
        rim = PER_SQUARE
        picture = cv2.copyMakeBorder(picture, *[rim] * 4, cv2.BORDER_CONSTANT, value=255)
        return picture, PER_SQUARE / board.size, corner + rim
    right = np.asarray(board.drawing.getRightBottomCorner()).ravel()[:2]
    scale = PER_SQUARE / board.size
    rim = PER_SQUARE // 2
    size = tuple(round(value * scale) + 2 * rim for value in right)
    picture = board.drawing.generateImage(size, marginSize=rim, borderBits=1)
    return picture, scale, np.array([rim, rim])


def lit(image, light, seed):
    """An image in another light: grey of black, of white, and noise; blurred [px]."""
    black, white, noise, blur = light
    shown = black + (white - black) * image.astype(np.float32) / 255.0
    shown = cv2.GaussianBlur(shown, (0, 0), blur) if blur else shown
    shown = shown + noise * np.random.default_rng(seed).standard_normal(image.shape)
    return np.clip(np.round(shown), 0, 255).astype(np.uint8)


def board_image(board, K, lens, size, pose, fisheye=False, wall=170):
    """An image, shape (height, width), 8 bits, of a board at a pose (R, p) in the camera."""
    picture, scale, corner = board_picture(board)
    width, height = size
    rays = _rays(K.tobytes(), lens.tobytes(), size, fisheye)
    R, p = pose
    across, normal = R[:, :2].T, R[:, 2]
    A = (normal @ p) * across - np.outer(across @ p, normal)
    depth = normal.astype(np.float32) @ rays
    where = (A.astype(np.float32) @ rays) / depth * scale + corner[:, None] - 0.5
    where[:, depth * (normal @ p) <= 0.0] = -1e4
    shape = (FINE * height, FINE * width)
    drawn = cv2.remap(
        picture, where[0].reshape(shape).astype(np.float32),
        where[1].reshape(shape).astype(np.float32), cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT, borderValue=wall,
    )  # fmt: skip
    return cv2.resize(drawn, size, interpolation=cv2.INTER_AREA)


@lru_cache(maxsize=2)
def _rays(K, lens, size, fisheye):
    """Directions of samples, shape (3, n), by OpenCV."""
    width, height = size
    v, u = (np.mgrid[: FINE * height, : FINE * width] + 0.5) / FINE - 0.5
    at = np.stack([u.ravel(), v.ravel()], axis=1).reshape(-1, 1, 2)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-10)
    undistort = cv2.fisheye.undistortPoints if fisheye else cv2.undistortPoints
    K = np.frombuffer(K).reshape(3, 3)
    xy = undistort(at, K, np.frombuffer(lens), criteria=criteria).reshape(-1, 2)
    return np.column_stack([xy, np.ones(len(xy))]).T.astype(np.float32)


def board_poses(board, count, distance, seed=0, spread=0.5):
    """Poses (R, p) of boards before a camera, tilted and all over the image."""
    random = np.random.default_rng(seed)
    extent = board.size * np.array([board.columns, board.rows])
    if board.kind != CHARUCO and board.kind != CHESSBOARD:
        extent = np.asarray(board.drawing.getRightBottomCorner()).ravel()[:2]
    poses = []
    for k in range(count):
        tilt = np.radians(random.uniform(15.0, 35.0))
        way = 2.0 * np.pi * (k / count + random.uniform(0.0, 0.1))
        axis = tilt * np.array([np.cos(way), np.sin(way), 0.0])
        spin = np.array([0.0, 0.0, np.radians(random.uniform(-25.0, 25.0))])
        R = cv2.Rodrigues(axis)[0] @ cv2.Rodrigues(spin)[0]
        depth = distance * random.uniform(0.8, 1.3)
        shift = np.array([*random.uniform(-spread, spread, 2) * depth * [0.7, 0.5], depth])
        poses.append((R, shift - R @ np.array([*(0.5 * extent), 0.0])))
    return poses


def make_board(kind):
    """A board of each kind, of about 0.3 x 0.2 m."""
    if kind == "tags":
        return CalibrationBoard(kind, 5, 4, 0.05)
    return CalibrationBoard(kind, 9, 7, 0.035)
