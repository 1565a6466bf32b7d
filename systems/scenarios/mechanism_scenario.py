"""The schema of a scenario file that moves a mechanism: cables between any bodies.

`MechanismScenario` is the file; its sections stand before it. What a plant makes of `motion` is in
`mechanism_motion`.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from cdpr_drake.errors import Problems, ScenarioError
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.fields import (
    FASTEST,
    array,
    named_numbers,
    named_sections,
    number,
    optional_section,
    section,
    sections,
    text,
)
from cdpr_drake.systems.robots.settings import COMPILED, PLANT, CableSettings
from cdpr_drake.systems.scenarios.files import MECHANISM
from cdpr_drake.systems.scenarios.run_settings import ExpectedEnd, RunHeader
from cdpr_drake.tensions.methods import METHODS

COMPUTED_TORQUE, WINCHES = "computed_torque", "winches"
CONTROLS = (COMPUTED_TORQUE, WINCHES)
"""Cables have the tensions that are commanded, or winches wind them along the wanted motion."""

USUAL_METHOD = "quadratic_program"


@dataclass(kw_only=True)
class Waypoint:
    """Where joints and free bodies are at a time, at rest."""

    time: float = number("When they are there.", "s", above=0.0)
    joints: dict[str, np.ndarray] = named_numbers(
        "Positions of joints by name, as in the mechanism's home; others stay where they were.",
        "rad, m",
    )
    bodies: dict[str, Pose] = named_sections(
        "Poses in W of bodies that no joint carries, by name; others stay where they were."
    )


@dataclass(kw_only=True)
class WantedMotion:
    """Waypoints from the home positions on; quintic time law in between, turns by slerp."""

    waypoints: list[Waypoint] = sections("The waypoints, their times growing.")


@dataclass(kw_only=True)
class MechanismControl:
    """What makes the mechanism follow the wanted motion."""

    kind: str = text(
        "computed_torque: massless, inextensible cables have the tensions that computed torque "
        "asks for, and motors of joints do the rest; winches: ideal winches wind cables to the "
        "lengths of the wanted motion at the strains of the start, and motors of joints follow it.",
        choices=CONTROLS,
    )
    kp: float = number(
        "Gain of positions; of winches for motors of joints alone.", "1/s^2", 400.0, at_least=0.0
    )
    kd: float = number(
        "Gain of velocities; of winches for motors of joints alone.", "1/s", 40.0, at_least=0.0
    )
    rate: float = number("Control steps per second.", "Hz", 1000.0, above=0.0, at_most=FASTEST)
    method: str = text(
        "Tension distribution of computed_torque.", USUAL_METHOD, choices=tuple(METHODS)
    )
    limits: np.ndarray | None = array(
        "Smallest and largest tension that are asked for; null: the mechanism's.",
        "N", (2,), None, at_least=0.0,
    )  # fmt: skip
    prestress: float | None = number(
        "Wanted tension of all cables: of winches at the start, where null is as small as can be; "
        "of computed_torque by reference_program alone.",
        "N",
        None,
        at_least=0.0,
    )


@dataclass(kw_only=True)
class MechanismSteps:
    """How the mechanism is integrated."""

    engine: str = text(
        "What moves it: Drake's MultibodyPlant, or, with winches, compiled steps of the same law.",
        PLANT,
        choices=(PLANT, COMPILED),
    )
    max_step: float = number("Step, by runge_kutta3.", "s", 1e-3, above=0.0)


@dataclass(kw_only=True)
class MechanismScenario(RunHeader):
    """One run of a mechanism that follows a motion on its cables."""

    kind: str = text("Kind of run.", choices=(MECHANISM,))
    mechanism: str = text(
        "Mechanism by name, or path of its file or folder, from this file or the working folder."
    )
    duration: float = number("Simulated time.", "s", above=0.0)
    expected: ExpectedEnd | None = optional_section(
        "How a run of the file as it stands ends, as the largest errors of a joint or free body; "
        "null: nothing is expected. It changes no run."
    )
    cables: CableSettings = section(
        "The simulated cables; those of computed_torque have pulleys only.",
        CableSettings,
        required=False,
    )
    motion: WantedMotion = section("Wanted motion.", WantedMotion)
    control: MechanismControl = section("What makes it follow.", MechanismControl)
    integration: MechanismSteps = section("Integration.", MechanismSteps, required=False)
    log_rate: float = number("Rows of the log per second.", "Hz", 100.0, above=0.0, at_most=FASTEST)

    def limits(self, mechanism: Mechanism) -> tuple[float, float]:
        """Smallest and largest tension that are asked for [N]."""
        given = self.control.limits
        return mechanism.tension_limits(
            None if given is None else (float(given[0]), float(given[1]))
        )


def check_settings(scenario: MechanismScenario, path: Path) -> None:
    """What no single field of a scenario can tell; does not look at the mechanism.

    Raises:
        ScenarioError: Settings that do not go together, or times that do not grow.
    """
    problems, control = Problems(ScenarioError), scenario.control

    def fail(key: str, found: object, accepted: str) -> None:
        problems.add(f"{path}: {key}: found {found}; accepted: {accepted}")

    if control.limits is not None and not control.limits[0] < control.limits[1]:
        fail("control.limits", control.limits.tolist(), "lower < upper")
    if control.kind == COMPUTED_TORQUE:
        usual = CableSettings(pulleys=scenario.cables.pulleys)
        for field in fields(CableSettings):
            value = getattr(scenario.cables, field.name)
            if value != getattr(usual, field.name):
                fail(f"cables.{field.name}", value, f"with {WINCHES}; ideal cables have none")
        if scenario.integration.engine != PLANT:
            fail("integration.engine", scenario.integration.engine, f"{PLANT} by {COMPUTED_TORQUE}")
        needed = METHODS[control.method].needs_reference
        if needed and control.prestress is None:
            fail("control.prestress", "null", f"a tension, which {control.method} needs [N]")
        if not needed and control.prestress is not None:
            fail("control.prestress", f"{control.prestress:g}", f"null with {control.method}")
    elif control.method != USUAL_METHOD:
        fail("control.method", control.method, f"with {COMPUTED_TORQUE}; winches share no tensions")
    waypoints, before = scenario.motion.waypoints, 0.0
    if not waypoints:
        fail("motion.waypoints", "none", "at least one")
    for k, each in enumerate(waypoints):
        if not each.time > before:
            fail(f"motion.waypoints[{k}].time", f"{each.time:g}", f"above {before:g} [s]")
        before = each.time
    problems.raise_any()
