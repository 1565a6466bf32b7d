"""How CAROCA's cables are simulated, in all case studies alike.

The servoing thesis asks in A.1.2 for a sagging elastic model: elastic catenaries over the
prototype's pulleys, with the modulus and diameter printed there. The controller's model stays the
straight one without pulleys, as in the thesis.

What brakes the platform's swing beside the cables is printed nowhere. 4 % of critical, a value from
literature, leaves that swing undamped under the printed gain; the value here is fitted to two
things that the thesis tells of its prototype: it converges with a gain of 1.5 1/s (2.3), and its
error oscillates with 1.7 1/s (4.4.2). The linear loop of `slack_cycle` is stable with these gains
from 208 and from 240 N s/m on. How both choices came about, and what was known at the time, is told
in docs/theory/reproduction.md, "The cables of CAROCA".
"""

SWING_HZ = 2.23
"""Slowest mode of the platform where the straight model's change of lengths takes it from the
start of section 2.3.4 to its goal: two cables then pull with little more than their weight [Hz]."""

SWING_DAMPING = (225.0, 4.2)
"""Of the platform, fitted: 5.4 % of critical for that mode, by mass and by the mean moment of
inertia about the centre of mass [N s/m, N m s/rad]."""

TIME = 150.0
"""When runs are stopped: one that has not converged in the scenario's 90 s has not yet failed [s].
"""

CAROCA_CABLES = (
    "cables={model: catenary, pulleys: true}",
    f"damping={{translation: {SWING_DAMPING[0]:g}, rotation: {SWING_DAMPING[1]:g}}}",
)
"""Items for scenarios: CAROCA's cables and damping."""

CAROCA_RUN = (*CAROCA_CABLES, f"duration={TIME:g}")
"""The same for runs that end when the servo has converged."""

CAROCA_ASSUMPTION = (
    "CAROCA's cables are catenaries over pulleys, of the printed modulus and diameter and of the "
    "weight of solid steel, as A.1.2 asks for. The platform's swing is damped by "
    f"{SWING_DAMPING[0]:g} N s/m and {SWING_DAMPING[1]:g} N m s/rad. That is fitted so that a gain "
    "of 1.5 1/s converges, and 1.7 1/s is at the limit; nothing else is. All cases on CAROCA have "
    "these cables."
)
"""The same in words."""
