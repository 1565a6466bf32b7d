"""What a result is about: a robot as it was, and perhaps a pose; and whether that is still open."""

from __future__ import annotations

import asyncio
import dataclasses
import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic
from typing import Any

import numpy as np
from nicegui import Event
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.robot_schema import Robot

CLOCK = 0.02
"""What an event loop may be early [s]."""


@dataclass(frozen=True)
class Subject:
    """What a result is about.

    Attributes:
        robot: Name of the robot; empty: robots of their own, whatever is open.
        digest: Of all data of the robot; empty: not known.
        pose: X_WP as (qw, qx, qy, qz, x, y, z) [-, m]; None: it belongs to no pose.
    """

    robot: str
    digest: str = ""
    pose: tuple[float, ...] | None = None

    def at(self, X_WP: RigidTransform) -> Subject:
        """The same robot at a pose."""
        return dataclasses.replace(self, pose=tuple(float(value) for value in pose_row(X_WP)))

    def differs(self, now: Subject) -> str:
        """By what it is about something else than what is open now, in words; empty: it is not."""
        if not self.robot:
            return "of robots of their own, not of the robot that is open"
        if self.robot != now.robot:
            return f"of {self.robot}, not of {now.robot}, which is open"
        if not self.digest:
            return f"of a robot named {self.robot}; whether it was as it is now is not known"
        if self.digest != now.digest:
            return f"of {self.robot} as it was before, not as it is now"
        if self.pose is not None and self.pose != now.pose:
            return "of the pose before, not of this one"
        return ""

    @property
    def fingerprint(self) -> str:
        """Eight digits of the digest, which two of a thousand robots share once in 10,000."""
        return self.digest[:8]

    def is_another(self, now: Subject) -> bool:
        """Whether it is known to be about another robot, or the robot as it was before."""
        return self.robot != now.robot or bool(self.digest and self.digest != now.digest)


NOTHING = Subject("")
"""Of what is not known to be about any robot."""


def subject_of(robot: Robot) -> Subject:
    """What a result about a robot is about."""

    def plain(value: Any) -> Any:
        return value.tolist() if isinstance(value, np.ndarray | np.generic) else repr(value)

    data = json.dumps(dataclasses.asdict(robot), default=plain, sort_keys=True)
    return Subject(robot.name, hashlib.sha256(data.encode()).hexdigest())


class Results:
    """What the results that a session's panels show are about, by the name of the result.

    `changed` tells when a result, the robot or the pose has changed.
    """

    def __init__(self, now: Callable[[], Subject]) -> None:
        """Of a workbench; `now` says what is open there."""
        self._now, self.changed = now, Event[[]]()
        self._subjects: dict[str, Subject | None] = {}
        self._awaited: dict[str, float] = {}  # until when

    def wait_for(self, name: str, longest: float) -> None:
        """Says nothing of a result that is about something else for so long [s]: one comes."""
        self._awaited[name] = monotonic() + longest
        asyncio.get_running_loop().call_later(longest + CLOCK, self.changed.emit)

    def show(self, name: str, subject: Subject | None) -> None:
        """Says what the result of a name is about from now on; None: there is none any more."""
        before, self._subjects[name] = self.subject(name), subject
        if before != subject:
            self.changed.emit()

    def subject(self, name: str) -> Subject | None:
        """What a result is about; None: there is none."""
        return self._subjects.get(name)

    def differs(self, name: str) -> str:
        """By what a result is about something else; empty: it is not, or one is waited for."""
        subject, waits = self.subject(name), monotonic() < self._awaited.get(name, 0.0)
        return "" if subject is None or waits else subject.differs(self._now())
