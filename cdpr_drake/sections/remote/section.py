"""Section `remote` of a scenario: a process outside closes the loop."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Annotated, Any

from cdpr_drake.schema.declarations import In, OneOf, Refusal, Scope, settings
from cdpr_drake.sections.remote.driver import SyncMode
from cdpr_drake.sections.remote.place import DISTRIBUTOR, SERVO_PLACES, TENSION_PLACES, TWIST
from cdpr_drake.sections.remote.servo import RemoteServo
from cdpr_drake.sections.remote.tensions import RemoteDistributor, RemoteTracking
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL
from cdpr_drake.systems.sections import Section

PLACES = (*TENSION_PLACES, *SERVO_PLACES)


@settings
class RemoteSettings(Section):
    """Where a process outside stands, and how the run waits for it; see cdpr serve."""

    words = "A process outside in the place of a block, see cdpr serve"
    report = "cdpr_drake.sections.remote.report:SUBJECTS"
    outside = True

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

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """A place that the kind of scenario does not have, or what contradicts it."""
        scenario = scope.whole
        is_servo = scenario.kind != TENSION_CONTROL
        places = SERVO_PLACES if is_servo else TENSION_PLACES
        if self.place not in places:
            yield "place", self.place, f"one of {', '.join(places)}"
        if not is_servo:
            if scenario.perturbations.believed_robot is not None:
                yield "/perturbations.believed_robot", "beside remote", "one of both"
            return
        for key in ("open_loop", "pose_plan"):
            if getattr(scenario, key, None) is not None:
                yield f"/{key}", "a section with remote", "null"
        if scenario.winches.mode == "torque" and self.place != TWIST:
            yield "place", f"{self.place} with winches.mode torque", TWIST

    def make_servo(self, model: Any, settings: Any) -> RemoteServo:
        """A `RemoteServo`."""
        return RemoteServo(
            model.controller, model.target, model.pinhole, settings.controller.rate,
            robot=model.robot, place=self.place, X_CdO=model.X_CdO,
        )  # fmt: skip

    def tension_blocks(self, settings: Any, robot: Any) -> Mapping[str, Any]:
        """A `RemoteDistributor` or a `RemoteTracking`."""
        if self.place == DISTRIBUTOR:
            return {"distributor": partial(RemoteDistributor, trajectory=settings.trajectory)}
        return {"controller": partial(RemoteTracking, place=self.place)}

    def tension_loop(self, control: Any) -> Callable[[Any, float], Any] | None:
        """A `RemoteTensionLoop`, where the engine is compiled."""
        from cdpr_drake.sections.remote.tension_loop import RemoteTensionLoop, can_be_stepped

        return RemoteTensionLoop if can_be_stepped(control) else None
