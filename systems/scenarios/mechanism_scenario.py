"""The schema of a scenario file that moves a mechanism: cables between any bodies.

`MechanismScenario` is the file; its sections stand before it. What a plant makes of `motion` is in
`mechanism_motion`.
"""

from collections.abc import Iterator
from dataclasses import fields
from typing import Annotated

import numpy as np

from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import (
    FASTEST,
    In,
    OneOf,
    Refusal,
    Scope,
    Text,
    filled,
    settings,
)
from cdpr_drake.systems.robots.settings import COMPILED, PLANT, CableSettings
from cdpr_drake.systems.scenarios.files import MECHANISM
from cdpr_drake.systems.scenarios.run_settings import ExpectedEnd, RunHeader
from cdpr_drake.tensions.methods import METHODS

COMPUTED_TORQUE, WINCHES = "computed_torque", "winches"
CONTROLS = (COMPUTED_TORQUE, WINCHES)
"""Cables have the tensions that are commanded, or winches wind them along the wanted motion."""

USUAL_METHOD = "quadratic_program"


@settings
class Waypoint:
    """Where joints and free bodies are at a time, at rest."""

    time: Annotated[float, In("s", gt=0.0), "When they are there."]
    joints: Annotated[
        dict[str, np.ndarray],
        In("rad, m", None, single=True),
        "Positions of joints by name, as in the mechanism's home; others stay where they were.",
    ] = filled(dict)
    bodies: Annotated[
        dict[str, Pose],
        "Poses in W of bodies that no joint carries, by name; others stay where they were.",
    ] = filled(dict)


@settings
class WantedMotion:
    """Waypoints from the home positions on; quintic time law in between, turns by slerp."""

    waypoints: Annotated[list[Waypoint], "The waypoints, their times growing."]


@settings
class MechanismControl:
    """What makes the mechanism follow the wanted motion."""

    kind: Annotated[
        str,
        OneOf(CONTROLS),
        "computed_torque: massless, inextensible cables have the tensions that computed "
        "torque asks for, and motors of joints do the rest; winches: ideal winches wind "
        "cables to the lengths of the wanted motion at the strains of the start, and "
        "motors of joints follow it.",
    ]
    kp: Annotated[
        float, In("1/s^2", ge=0.0), "Gain of positions; of winches for motors of joints alone."
    ] = 400.0
    kd: Annotated[
        float, In("1/s", ge=0.0), "Gain of velocities; of winches for motors of joints alone."
    ] = 40.0
    rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Control steps per second."] = 1000.0
    method: Annotated[str, OneOf(METHODS), "Tension distribution of computed_torque."] = (
        USUAL_METHOD
    )
    limits: Annotated[
        np.ndarray | None,
        In("N", 2, ge=0.0),
        "Smallest and largest tension that are asked for; null: the mechanism's.",
    ] = None
    prestress: Annotated[
        float | None,
        In("N", ge=0.0),
        "Wanted tension of all cables: of winches at the start, where null is as small as"
        " can be; of computed_torque by reference_program alone.",
    ] = None


@settings
class MechanismSteps:
    """How the mechanism is integrated."""

    engine: Annotated[
        str,
        OneOf((PLANT, COMPILED)),
        "What moves it: Drake's MultibodyPlant, or, with winches, compiled steps of the same law.",
    ] = PLANT
    max_step: Annotated[float, In("s", gt=0.0), "Step, by runge_kutta3."] = 0.001


@settings
class MechanismScenario(RunHeader):
    """One run of a mechanism that follows a motion on its cables."""

    kind: Annotated[str, OneOf((MECHANISM,)), "Kind of run."]
    mechanism: Annotated[
        Text,
        "Mechanism by name, or path of its file or folder, from this file or the working folder.",
    ]
    duration: Annotated[float, In("s", gt=0.0), "Simulated time."]
    expected: Annotated[
        ExpectedEnd | None,
        "How a run of the file as it stands ends, as the largest errors of a joint or "
        "free body; null: nothing is expected. It changes no run.",
    ] = None
    cables: Annotated[
        CableSettings, "The simulated cables; those of computed_torque have pulleys only."
    ] = filled(CableSettings)
    motion: Annotated[WantedMotion, "Wanted motion."]
    control: Annotated[MechanismControl, "What makes it follow."]
    integration: Annotated[MechanismSteps, "Integration."] = filled(MechanismSteps)
    log_rate: Annotated[float, In("Hz", gt=0.0, le=FASTEST), "Rows of the log per second."] = 100.0

    def limits(self, mechanism: Mechanism) -> tuple[float, float]:
        """Smallest and largest tension that are asked for [N]."""
        given = self.control.limits
        return mechanism.tension_limits(
            None if given is None else (float(given[0]), float(given[1]))
        )

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """Settings that do not go together; does not look at the mechanism."""
        control, integration = self.control, self.integration
        if control.limits is not None and not control.limits[0] < control.limits[1]:
            yield "control.limits", control.limits.tolist(), "lower < upper"
        if control.kind == COMPUTED_TORQUE:
            usual = CableSettings(pulleys=self.cables.pulleys)
            for field in fields(CableSettings):
                value = getattr(self.cables, field.name)
                if value != getattr(usual, field.name):
                    yield f"cables.{field.name}", value, f"with {WINCHES}; ideal cables have none"
            if integration.engine != PLANT:
                yield "integration.engine", integration.engine, f"{PLANT} by {COMPUTED_TORQUE}"
            needed = METHODS[control.method].needs_reference
            if needed and control.prestress is None:
                accepted = f"a tension, which {control.method} needs [N]"
                yield "control.prestress", "null", accepted
            if not needed and control.prestress is not None:
                yield "control.prestress", f"{control.prestress:g}", f"null with {control.method}"
        elif control.method != USUAL_METHOD:
            accepted = f"with {COMPUTED_TORQUE}; winches share no tensions"
            yield "control.method", control.method, accepted
        if not self.motion.waypoints:
            yield "motion.waypoints", "none", "at least one"
        before = 0.0
        for k, each in enumerate(self.motion.waypoints):
            if not each.time > before:
                yield f"motion.waypoints[{k}].time", f"{each.time:g}", f"above {before:g} [s]"
            before = each.time
