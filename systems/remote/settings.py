"""Scenario section `remote`: a process outside closes the loop."""

from collections.abc import Collection, Iterator
from typing import Annotated

from cdpr_drake.schema.declarations import In, OneOf, Refusal, Scope, settings
from cdpr_drake.systems.remote.remote_driver import SyncMode
from cdpr_drake.systems.remote.remote_place import SERVO_PLACES, TENSION_PLACES, TWIST

PLACES = (*TENSION_PLACES, *SERVO_PLACES)


@settings
class RemoteSettings:
    """Where a process outside stands, and how the run waits for it; see cdpr serve."""

    place: Annotated[
        str,
        OneOf(PLACES),
        "Which block it replaces: distributor, controller or trajectory of dynamic "
        "control, or servo (cable velocities) or twist (of the platform) of a visual "
        "servo.",
    ]
    pace: Annotated[
        str,
        OneOf(tuple(pace.value for pace in SyncMode)),
        "Whether the run waits for each command, or goes on in real time with the last one.",
    ] = SyncMode.LOCK_STEP.value
    timeout: Annotated[
        float, In("s", gt=0.0, le=86400.0), "Silence of the process after which the run ends."
    ] = 10.0


def place_refusals(settings: RemoteSettings | None, places: Collection[str]) -> Iterator[Refusal]:
    """A place that a scenario does not have."""
    if settings is not None and settings.place not in places:
        yield "remote.place", settings.place, f"one of {', '.join(places)}"


def servo_place_refusals(scope: Scope) -> Iterator[Refusal]:
    """A place that a visual servo does not have, or what contradicts it."""
    scenario, remote = scope.whole, scope.whole.remote
    yield from place_refusals(remote, SERVO_PLACES)
    if remote is None:
        return
    for key in ("open_loop", "pose_plan"):
        if getattr(scenario, key) is not None:
            yield key, "a section with remote", "null"
    if scenario.winches.mode == "torque" and remote.place != TWIST:
        yield "remote.place", f"{remote.place} with winches.mode torque", TWIST
