"""Section `disturbances` of a scenario, and its block: what pushes the platform beside its cables.

Every push begins at a time and may end at one. A force f acts at a point Q of the platform, so that
the wrench about Po is (m + p_PoQ x f, f).

* step: f and m, constant;
* push: a half sine, f sin(pi (t - start) / (end - start)) and m likewise: an impulse of
  2 (end - start) f / pi;
* sine: f sin(2 pi nu (t - start)) and m likewise;
* wind: rho c_d A |v| v / 2 with v = V + u, V the mean wind and u its turbulence along each axis, of
  Dryden's longitudinal spectrum, S(omega) = 2 sigma^2 L / (pi |V|) / (1 + (L omega / |V|)^2), sigma
  the intensity times |V|: a random signal of first order with the time constant L / |V|, exact at
  any period. How fast the platform moves itself is left out;
* payload: the weight of a mass at Q, below zero of one that is lost. What it adds to the inertia is
  left out.

Source of the spectrum: MIL-F-8785C, Flying qualities of piloted airplanes, 1980, 3.7.1.2.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ScenarioError
from cdpr_drake.estimation.sensor_noise import sample_noise
from cdpr_drake.schema.declarations import In, OneOf, Refusal, Scope, settings, values
from cdpr_drake.schema.typed_yaml import refuse
from cdpr_drake.systems.scenarios.files import TENSION_CONTROL
from cdpr_drake.systems.sections import Platform, Section

STEP, PUSH, SINE, WIND, PAYLOAD = "step", "push", "sine", "wind", "payload"

NEEDED = {
    STEP: (),
    PUSH: ("end",),
    SINE: ("frequency",),
    WIND: ("wind", "drag_area"),
    PAYLOAD: ("mass",),
}
"""Fields that a kind needs, beside a force or moment of the first three."""

OWN = {
    "frequency": SINE, "wind": WIND, "drag_area": WIND, "intensity": WIND, "length_scale": WIND,
    "mass": PAYLOAD,
}  # fmt: skip
"""Fields that one kind has alone."""

WORLD, PLATFORM = "world", "platform"

AIR = 1.225
"""Density of air at 15 degrees Celsius and sea level [kg/m^3]."""

STREAM = 4200
"""Stream of the wind's random numbers, apart from those of sensors; one more for each wind."""

LARGEST_FORCE, LONGEST_PUSH = 1e6, 60.0
"""Limits of a push by hand [N, s]."""


@settings
class Push:
    """One thing that pushes the platform."""

    kind: Annotated[str, OneOf(NEEDED), "What it is like over time."]
    start: Annotated[float, In("s", ge=0.0), "When it begins."] = 0.0
    end: Annotated[float | None, In("s", gt=0.0), "When it ends; null: with the run."] = None
    force: Annotated[np.ndarray | None, In("N", 3), "Force."] = None
    moment: Annotated[np.ndarray | None, In("N m", 3), "Moment about Po."] = None
    frame: Annotated[
        str,
        OneOf((WORLD, PLATFORM)),
        "Axes of force and moment: those of W, or of P, which turn with the platform.",
    ] = WORLD
    point: Annotated[np.ndarray, In("m", 3), "Where the force acts, in P."] = values(0.0, 0.0, 0.0)
    frequency: Annotated[float | None, In("Hz", gt=0.0), "Of a sine."] = None
    wind: Annotated[np.ndarray | None, In("m/s", 3), "Mean wind in W."] = None
    drag_area: Annotated[
        float | None, In("m^2", gt=0.0), "Drag coefficient times area that the wind meets."
    ] = None
    intensity: Annotated[
        float | None,
        In("-", gt=0.0, le=1.0),
        "Of the wind's turbulence: standard deviation over mean speed; null: none.",
    ] = None
    length_scale: Annotated[float | None, In("m", gt=0.0), "Of the turbulence; null: 10 m."] = None
    mass: Annotated[float | None, In("kg"), "Of a payload; below zero: it is lost."] = None

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """What is missing, or belongs to another kind."""
        for name in NEEDED[self.kind]:
            if getattr(self, name) is None:
                yield name, "none", f"one, with {self.kind}"
        for name, kind in OWN.items():
            if kind != self.kind and getattr(self, name) is not None:
                yield name, f"one with {self.kind}", f"none, but with {kind}"
        given = self.force is not None or self.moment is not None
        if given != (self.kind in (STEP, PUSH, SINE)):
            accepted = "none" if given else "a force, a moment, or both"
            found = "one" if given else "no force and no moment"
            yield "force", found, f"{accepted}, with {self.kind}"
        if self.end is not None and self.end <= self.start:
            yield "end", f"{self.end:g} s", f"above the start, {self.start:g} s"
        if self.kind == WIND and self.wind is not None and not np.any(self.wind):
            yield "wind", "none", "a mean speed above 0 [m/s]"
        if self.kind == PAYLOAD and self.mass == 0.0:
            yield "mass", "0", "above or below 0 [kg]"

    def share(self, time: float) -> float:
        """What of force and moment acts at a time [s]."""
        if time < self.start or (self.end is not None and time >= self.end):
            return 0.0
        since = time - self.start
        if self.kind == PUSH:
            assert self.end is not None
            return float(np.sin(np.pi * since / (self.end - self.start)))
        if self.kind == SINE:
            assert self.frequency is not None
            return float(np.sin(2.0 * np.pi * self.frequency * since))
        return 1.0

    def wrench(self, time: float, R_WP: Array, gravity: Array, gust: Array) -> Array:
        """Moment about Po and force in W at a time, shape (6,) [N m, N].

        Args:
            time: The time [s].
            R_WP: Rotation of the platform, shape (3, 3).
            gravity: Acceleration of a falling body in W, shape (3,) [m/s^2].
            gust: Turbulence of the wind, shape (3,) [m/s].
        """
        share = self.share(time)
        if share == 0.0:
            return np.zeros(6)
        force, moment = np.zeros(3), np.zeros(3)
        if self.kind == PAYLOAD:
            assert self.mass is not None
            force = self.mass * gravity
        elif self.kind == WIND:
            assert self.wind is not None
            assert self.drag_area is not None
            v = self.wind + gust
            force = 0.5 * AIR * self.drag_area * float(np.linalg.norm(v)) * v
        else:
            turn = R_WP if self.frame == PLATFORM else np.eye(3)
            force = force if self.force is None else share * (turn @ self.force)
            moment = moment if self.moment is None else share * (turn @ self.moment)
        return np.concatenate([moment + np.cross(R_WP @ self.point, force), force])

    def turbulence(self, period: float) -> tuple[float, float]:
        """Share of a gust that is left after a period [s], and its standard deviation [m/s]."""
        if self.wind is None or self.intensity is None:
            return 0.0, 0.0
        speed = float(np.linalg.norm(self.wind))
        length = 10.0 if self.length_scale is None else self.length_scale
        return float(np.exp(-period * speed / length)), self.intensity * speed


@settings
class DisturbanceSettings(Section):
    """What pushes the platform, and how often that changes."""

    words = "What pushes the platform beside its cables; dynamic control has it by the engine plant"
    report = "cdpr_drake.sections.disturbances.report:SUBJECTS"
    by_hand: ClassVar = {PUSH: "{pushes: [{kind: step, force: [0.0, 0.0, 0.0]}]}"}

    pushes: Annotated[list[Push], "What pushes the platform; all of it adds up."]
    rate: Annotated[
        float,
        In("Hz", gt=0.0, le=100000.0),
        "How often the wrench changes; between, it is that of the middle of the period.",
    ] = 1000.0

    def refusals(self, scope: Scope) -> Iterator[Refusal]:
        """No push at all."""
        if not self.pushes:
            yield "pushes", "none", "at least one"

    def needs_plant(self, scenario: Any) -> bool:
        """Whether a scenario is one of dynamic control by tensions."""
        return bool(scenario.kind == TENSION_CONTROL)

    def push(self, builder: DiagramBuilder, platform: Platform) -> OutputPort:
        """Adds `Disturbances`."""
        gravity = platform.robot.gravity_vector()
        block = Disturbances(self, gravity, seed=platform.seed)
        builder.AddNamedSystem(platform.prefix + "disturbances", block)
        builder.Connect(platform.X_WP, block.get_input_port())
        return block.get_output_port()

    def do(self, request: Mapping[str, Any], now: float) -> dict[str, Any]:
        """Pushes at Po with half a sine of the peak `force` in W, for `seconds`."""
        try:
            force = np.array(request.get("force"), float)
            seconds = float(request.get("seconds", np.nan))
        except (TypeError, ValueError):
            force, seconds = np.full(3, np.nan), np.nan
        size = float(np.linalg.norm(force)) if force.shape == (3,) else np.nan
        if not 0.0 < size <= LARGEST_FORCE:
            raise ScenarioError(
                f"force: found {str(request.get('force'))[:60]}; accepted: three numbers, together "
                f"above 0 to {LARGEST_FORCE:g} N"
            )
        if not 0.0 < seconds <= LONGEST_PUSH:
            raise ScenarioError(
                f"seconds: found {str(request.get('seconds'))[:60]}; accepted: above 0 to "
                f"{LONGEST_PUSH:g} s"
            )
        period = 1.0 / self.rate
        start = (math.floor(now / period) + 1) * period  # a period under way is not changed
        self.pushes.append(Push(kind=PUSH, start=start, end=start + seconds, force=force))
        return {"t": now, "words": f"push of {size:g} N for {seconds:g} s"}


class Disturbances(LeafSystem):
    """What pushes a platform, as a wrench that is constant from period to period.

    ====== ============== ====== ================================================================
    port   type           unit   meaning
    ====== ============== ====== ================================================================
    X_WP   RigidTransform m      in, pose of the platform, read at the period's begin
    wrench vector(6)      N m, N out, moment about Po and force, in W, for a robot's applied_wrench
    ====== ============== ====== ================================================================

    State: wrench, and the gusts of each push. Random numbers depend on the seed and the number of
    the period alone. A push but wind may be appended to those of the settings before it begins,
    while a simulation runs.
    """

    def __init__(self, settings: DisturbanceSettings, gravity: Array, *, seed: int = 0) -> None:
        """With settings that are checked, gravity in W, shape (3,) [m/s^2], and a seed."""
        super().__init__()
        refuse(settings, "disturbances", error=ScenarioError)
        self._settings, self._gravity, self._seed = settings, np.asarray(gravity, float), seed
        self._period = 1.0 / settings.rate
        self._turbulence = [push.turbulence(self._period) for push in settings.pushes]
        self._pose = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        state = self.DeclareDiscreteState(6 + 3 * len(settings.pushes))
        needs = {self.discrete_state_ticket(state)}
        self.DeclareVectorOutputPort("wrench", 6, self._calc, needs)
        self.DeclareInitializationDiscreteUpdateEvent(self._begin)
        self.DeclarePeriodicDiscreteUpdateEvent(self._period, 0.0, self._update)

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state_vector().value()[:6])

    def _begin(self, context: Context, state: DiscreteValues) -> None:
        if context.get_time() == 0.0:
            state.set_value(self._next(context, np.zeros(state.get_vector().size())))

    def _update(self, context: Context, state: DiscreteValues) -> None:
        state.set_value(self._next(context, context.get_discrete_state_vector().value()))

    def _next(self, context: Context, now: Array) -> Array:
        number_ = round(context.get_time() / self._period)
        R_WP = self._pose.Eval(context).rotation().matrix()
        middle = (number_ + 0.5) * self._period
        out = np.zeros_like(now)
        for k, push in enumerate(self._settings.pushes):
            kept, sigma = self._turbulence[k] if k < len(self._turbulence) else (0.0, 0.0)
            gust = slice(6 + 3 * k, 9 + 3 * k)
            if sigma > 0.0:
                fresh = sample_noise(self._seed, STREAM + k, number_, 3)
                before, new = (0.0, 1.0) if number_ == 0 else (kept, np.sqrt(1.0 - kept**2))
                out[gust] = before * now[gust] + new * sigma * fresh
            out[:6] += push.wrench(middle, R_WP, self._gravity, out[gust])
        return out
