"""The kinds of targets that a scenario can name; a new one is one entry of `TARGETS`.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from cdpr_drake.models import Pose
from cdpr_drake.schema import number, section, whole
from cdpr_drake.textures import TexturedTarget
from cdpr_drake.vision import TAG_COUNT, CircleTarget, DotTarget, TagBundle, TagTarget, Target


@dataclass(kw_only=True)
class BundledTag:
    """One AprilTag of a bundle."""

    tag_id: int = whole("Identity of the tag.", at_least=0, at_most=TAG_COUNT - 1)
    size: float = number("Edge of the black square.", "m", above=0.0)
    pose: Pose = section("Pose of the tag's frame in the object frame O.", Pose)


class TargetPattern(Protocol):
    """What the kinds of targets are made from; `TargetSettings` is one."""

    kind: str
    tag_id: int
    size: float
    tags: list[BundledTag]
    texture: str


def _bundle(settings: TargetPattern) -> Target:
    tags = settings.tags
    poses = [tag.pose.transform() for tag in tags]
    return TagBundle([tag.tag_id for tag in tags], [tag.size for tag in tags], poses)


TARGETS: dict[str, Callable[[TargetPattern], Target]] = {
    "tag": lambda settings: TagTarget(settings.tag_id, settings.size),
    "tag_bundle": _bundle,
    "dots": lambda settings: DotTarget(settings.size),
    "circles": lambda settings: CircleTarget(settings.size),
    "textured": lambda settings: TexturedTarget(settings.texture, settings.size),
}
"""Makes a target from the section `target` of a scenario, by its kind."""
