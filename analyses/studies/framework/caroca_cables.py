"""CAROCA in all case studies alike: as its file describes it, over its pulleys.

Its cables sag, as the servoing thesis asks for in A.1.2, and its platform is damped by a value that
is fitted to two things that the thesis tells of the prototype: it converges with a gain of 1.5 1/s
(2.3), and its error oscillates with 1.7 1/s (4.4.2). How both came about is told in
docs/theory/reproduction.md, "The cables of CAROCA".
"""

from cdpr_drake.analyses.studies.framework.case_definition import PULLEYS

CAROCA_RUN = (PULLEYS, "duration=150")
"""Items for runs that end when the servo has converged; one that has not within the 90 s of its
scenario has not yet failed."""

CAROCA_ASSUMPTION = (
    "CAROCA's cables are catenaries over pulleys, of the printed modulus and diameter and of the "
    "weight of solid steel, as A.1.2 asks for; the platform's swing is damped by what its robot "
    "file says. That damping is fitted so that a gain of 1.5 1/s converges, and 1.7 1/s is at the "
    "limit; nothing else is. All cases on CAROCA have these cables."
)
"""The same in words."""
