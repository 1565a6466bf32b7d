"""How CAROCA's cables are simulated, in all case studies alike.

The servoing thesis asks in A.1.2 for a sagging elastic model: elastic catenaries over the
prototype's pulleys, with the modulus and diameter printed there. The controller's model stays the
straight one without pulleys, as in the thesis. What brakes the platform's swing beside the cables
is printed nowhere; the reasons for the numbers here, which were fixed before any run, are told in
docs/theory/reproduction.md, "The cables of CAROCA".
"""

SWING_HZ = 2.23
"""Slowest mode of the platform where the straight model's change of lengths takes it from the
start of section 2.3.4 to its goal: two cables then pull with little more than their weight [Hz]."""

SWING_SHARE = 0.04
"""Damping of that mode, of critical [-]: that of transmission lines of aluminium and steel.

Source: Adams and Askenazi, Building Better Products with Finite Element Analysis, 1999, table of
viscous damping ratios.
"""

SWING_DAMPING = (168.0, 3.1)
"""2 zeta omega times mass and times mean moment of inertia about the centre of mass
[N s/m, N m s/rad]."""

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
