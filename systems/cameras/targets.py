"""The kinds of targets that a scenario can name; a new one is one entry of `TARGETS`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.rings import CircleTarget
from cdpr_drake.vision.tags import TagBundle, TagTarget
from cdpr_drake.vision.target import Target

if TYPE_CHECKING:
    # The schema takes the names of the targets from here.
    from cdpr_drake.systems.cameras.target_settings import Target as TargetSettings


def _bundle(settings: TargetSettings) -> Target:
    tags = settings.tags
    poses = [tag.pose.transform() for tag in tags]
    return TagBundle([tag.tag_id for tag in tags], [tag.size for tag in tags], poses)


TARGETS: dict[str, Callable[[TargetSettings], Target]] = {
    "tag": lambda settings: TagTarget(settings.tag_id, settings.size),
    "tag_bundle": _bundle,
    "dots": lambda settings: DotTarget(settings.size),
    "circles": lambda settings: CircleTarget(settings.size),
}
"""Makes a target from the section `target` of a scenario, by its kind."""


def make_target(settings: TargetSettings) -> Target:
    """The target of a scenario."""
    return TARGETS[settings.kind](settings)
