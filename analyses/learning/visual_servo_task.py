"""VisualServo: bring what the camera sees to what it shall see.

The camera on the platform looks at a tag, which is in front of a pose of the box. Features are the
tag's corners at unit focal length, with noise. With e the root mean square of s - s*,

    reward = 1 - tanh(e / 0.1) while the tag is seen, else 0, - costs

and an episode is lost once the tag was not seen for a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from cdpr_drake.analyses.learning.robot_picture import add_shown_body
from cdpr_drake.analyses.learning.robot_task import TWIST, RobotTask, TaskOptions
from cdpr_drake.analyses.learning.tag_picture import TagPicture
from cdpr_drake.analyses.learning.task_kernel import add_closeness, write_marks
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.scene import add_tag
from cdpr_drake.vision.apriltags import tag_corners
from cdpr_drake.vision.pinhole import Pinhole, normalize_points
from cdpr_drake.vision.target import VISIBLE_BORDER

FEATURES, IMAGE = "features", "image"

PLAIN_CAMERA = "astra"
"""Camera of the catalogue at Po, looking along -z of P, of robots without one on the platform."""

DEPTH, EDGE = 5.0, 1.0
"""Of the tag at the goal, and its edge, over half of the box's edge [-]."""

SHARE = 0.5
"""Of the box in which starts and goals are: there a camera of at least 42 deg sees the tag, at most
1 off the middle at a depth of 4."""

ERROR = 0.1
"""Error of features [-] at which the reward is down to 1 - tanh 1; a tenth of the depth."""

NEAR = 0.01
"""Error of features [-] of a success."""

BLIND = 1.0
"""For how long the tag may be out of sight [s]."""

POINTS = 4


@dataclass(frozen=True, kw_only=True)
class VisualServoOptions(TaskOptions):
    """What the task takes.

    Attributes:
        action: As of `TaskOptions`.
        period: Of images [s].
        camera: Name of a mounting on the platform; None: the first, else `PLAIN_CAMERA`.
        pixel_noise: Standard deviation of what is measured in the image [px].
        observation: "features", or "image": the tag as Drake renders it, 8 bits.
        image_width: Of such images [px].
    """

    action: str = TWIST
    period: float = 0.04
    camera: str | None = None
    pixel_noise: float = 0.5
    observation: str = FEATURES
    image_width: int = 96


class VisualServoTask(RobotTask):
    """The observation is s (8), s - s* (8), and 1 while the tag is seen: what is seen, no more."""

    Options: ClassVar[type[TaskOptions]] = VisualServoOptions

    def __init__(self, count: int, options: VisualServoOptions) -> None:
        """As `RobotTask`."""
        _check(options)
        super().__init__(count, options)
        X_PC, pinhole = _camera(self.robot, options.camera)
        self._pinhole, self._X_PC = pinhole, X_PC
        self._noise = options.pixel_noise
        half = self.reach
        self._points = tag_corners(EDGE * half)
        self._X_CdO = RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0.0, 0.0, DEPTH * half])
        p_CdK = self._X_CdO @ self._points
        self._wanted = (p_CdK[:2] / p_CdK[2]).ravel()
        self._objects = np.zeros((count, 3, 4))
        self._marks, self._found = np.zeros((count, 2 * POINTS)), np.zeros(count, bool)
        self._errors, self._blind = np.zeros((count, 1)), np.zeros(count)
        self._picture: TagPicture | None = None
        if options.observation == IMAGE:
            height = round(options.image_width * pinhole.height / pinhole.width)
            self._picture = TagPicture(EDGE * half, _scaled(pinhole, options.image_width, height))

    def _observed(self) -> int:
        return self._aimed()

    def _aimed(self) -> int:
        return 4 * POINTS + 1

    def _look_at_platforms(self) -> None:
        """Nothing: a policy knows images only."""

    def _own(self) -> Array:
        return self._numbers

    def _begin(self, row: int, random: np.random.Generator) -> RigidTransform:
        X_WPd = self.box.rest(self._drawn_pose(random, SHARE))
        self._objects[row] = (X_WPd @ self._X_PC @ self._X_CdO).GetAsMatrix34()
        return self._drawn_pose(random, SHARE)

    def _look(self, rows: np.ndarray, moved: bool) -> None:
        marks = np.zeros_like(self._marks)
        found = np.zeros(self.count, bool)
        write_marks(
            self.batch.poses, self._X_PC.GetAsMatrix34().copy(), self._objects, self._points,
            self._pinhole.numbers, VISIBLE_BORDER, marks, found,
        )  # fmt: skip
        own = self._own()
        for row in rows:
            noise = self._noise * self._random(row).standard_normal(2 * POINTS)
            if found[row]:
                self._marks[row] = marks[row] + noise
            self._found[row] = found[row]
            normalize_points(self._marks[row], self._pinhole.numbers, own[row, : 2 * POINTS])
            error = own[row, : 2 * POINTS] - self._wanted
            own[row, 2 * POINTS : 4 * POINTS] = error
            own[row, 4 * POINTS] = float(found[row])
            self._errors[row] = np.sqrt(np.mean(error * error))
            waited = self._blind[row] + self.options.period
            self._blind[row] = waited if moved and not found[row] else 0.0

    def _judge(self, actions: Array) -> None:
        add_closeness(self._errors, np.array([ERROR]), self._found.astype(float), self.rewards)
        self.lost |= self._blind >= BLIND

    def observations(self) -> np.ndarray:
        """Features, or images of shape (count, height, width, 3), 8 bits."""
        if self._picture is None:
            return super().observations()
        return np.stack([
            self._picture.draw(self._X_OC(row)) for row in range(self.count)
        ])  # fmt: skip

    def add_bodies(self, plant: MultibodyPlant) -> list[RigidBody]:
        """The tag."""
        tag = add_shown_body(plant, "tag")
        add_tag(plant, 0, EDGE * self.reach, RigidTransform(), tag)
        return [tag]

    def places(self, row: int) -> list[RigidTransform]:
        """That of the tag."""
        return [self._X_WO(row)]

    def _X_WO(self, row: int) -> RigidTransform:
        O = self._objects[row]  # noqa: E741
        return RigidTransform(RotationMatrix.ProjectToRotationMatrix(O[:, :3]), O[:, 3])

    def _X_OC(self, row: int) -> RigidTransform:
        return self._X_WO(row).inverse() @ pose_from_row(self.batch.poses[row]) @ self._X_PC

    def image_shape(self) -> tuple[int, int, int] | None:
        """Of an image that is observed; None: features are."""
        return None if self._picture is None else self._picture.shape

    def infos(self) -> dict[str, np.ndarray]:
        """Error of the features [-], whether the tag is seen, and whether the error is small."""
        error, found = self._errors[:, 0].copy(), self._found.copy()
        return {"error": error, "found": found, "success": found & (error < NEAR)}


def _camera(robot: Robot, name: str | None) -> tuple[RigidTransform, Pinhole]:
    """Where a camera is on the platform [m], and what it is without its lens.

    Raises:
        CdprError: There is no such camera.
    """
    mounts = {mount.name: mount for mount in robot.cameras if mount.parent == "platform"}
    if name is not None and name not in mounts:
        raise CdprError(
            f"camera: found {name!r}; accepted: {', '.join(mounts) or 'none'}, on the platform of "
            f"{robot.name}"
        )
    if not mounts:
        camera = load_camera(PLAIN_CAMERA)
        return RigidTransform(RotationMatrix.MakeXRotation(np.pi), np.zeros(3)), camera.pinhole(
            camera.width, camera.height
        ).ideal
    mount = mounts[name] if name is not None else next(iter(mounts.values()))
    camera = load_camera(mount.model)
    return mount.pose.transform(), camera.pinhole(camera.width, camera.height).ideal


def _scaled(pinhole: Pinhole, width: int, height: int) -> Pinhole:
    """The same view with other pixels."""
    u, v = width / pinhole.width, height / pinhole.height
    return Pinhole(
        width, height, u * pinhole.fx, v * pinhole.fy,
        u * (pinhole.cx + 0.5) - 0.5, v * (pinhole.cy + 0.5) - 0.5,
    )  # fmt: skip


def _check(options: VisualServoOptions) -> None:
    if options.observation not in (FEATURES, IMAGE):
        raise CdprError(
            f"observation: found {options.observation!r}; accepted: {FEATURES}, {IMAGE}"
        )
    if not (np.isfinite(options.pixel_noise) and options.pixel_noise >= 0.0):
        raise CdprError(f"pixel_noise: found {options.pixel_noise!r}; accepted: 0 or more [px]")
    if not 36 <= options.image_width <= 2000:
        raise CdprError(f"image_width: found {options.image_width!r}; accepted: 36 to 2000 [px]")
