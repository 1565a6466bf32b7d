"""Checks of a scenario's perturbations and estimators against its robot and target."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models import Robot
from cdpr_drake.systems.pose_estimators import ESTIMATORS

if TYPE_CHECKING:
    from cdpr_drake.systems.scenario import Scenario


def check_perturbations(scenario: Scenario, robot: Robot, path: Path) -> None:
    """Refuses lists that do not have one entry for each cable."""
    perturbations, m = scenario.perturbations, len(robot.cables)
    for name in ("exit_point_shifts", "anchor_point_shifts", "slack"):
        value = getattr(perturbations, name)
        if value is not None and len(value) != m:
            raise ScenarioError(
                f"{path}: perturbations.{name}: found {len(value)} rows; accepted: one for each "
                f"of the {m} cables of {robot.name}"
            )


def check_estimators(scenario: Scenario, robot: Robot, path: Path) -> None:
    """Refuses estimators that cannot work with this target, camera or known tag."""
    settings = scenario.estimator
    keys = {"estimator.kind": settings.kind}
    for index, name in enumerate(settings.compare):
        if name in settings.compare[:index]:
            raise ScenarioError(
                f"{path}: estimator.compare[{index}]: found {name} twice; accepted: each once"
            )
        keys[f"estimator.compare[{index}]"] = name
    blind = why_images_tell_nothing(scenario)
    for key, name in keys.items():
        if ESTIMATORS[name].needs_images and blind:
            others = [n for n, kind in ESTIMATORS.items() if not kind.needs_images]
            raise ScenarioError(
                f"{path}: {key}: found {name}, but {blind}; accepted: one of {', '.join(others)}"
            )
    _check_known_tag(scenario, "known_tag" in keys.values(), path)


def why_images_tell_nothing(scenario: Scenario) -> str:
    """Why the platform's pose does not follow from two images of the target; empty: it does."""
    target = scenario.target
    if target.carrier == "platform":
        return "the target moves with the platform and the camera stands in the world"
    if target.path().is_moving():
        return (
            "the target moves, so what differs between two images is its own motion as well as "
            "the platform's"
        )
    if target.kind == "circles":
        return "circles do not show their rotation about their middle"
    return ""


def _check_known_tag(scenario: Scenario, needed: bool, path: Path) -> None:
    known, target = scenario.estimator.known_tag, scenario.target
    if known is None:
        if needed:
            raise ScenarioError(
                f"{path}: estimator.known_tag: found none; accepted for kind known_tag: a tag"
            )
        return
    if target.carrier == "platform":
        raise ScenarioError(
            f"{path}: estimator.known_tag: found a tag, but the camera stands in the world; "
            "accepted: null"
        )
    used = {"tag": [target.tag_id], "tag_bundle": [tag.tag_id for tag in target.tags]}
    if known.tag_id in used.get(target.kind, []):
        raise ScenarioError(
            f"{path}: estimator.known_tag.tag_id: found {known.tag_id}, that of the target; "
            "accepted: another"
        )
