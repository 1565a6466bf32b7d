"""Study: the plant and the compiled engine beside each other, on all that ships and on draws.

`study_engines` runs both on every scenario, on taut motions of robots that are drawn, and on servos
with cables that go slack and catch; it measures orders of convergence, and the energy that impacts
put in or take out. The plant is the reference.
"""

from cdpr_drake.analyses.studies.engines.statements import JUDGES
from cdpr_drake.analyses.studies.engines.study import EnginesStudy, study_engines

__all__ = ["JUDGES", "EnginesStudy", "study_engines"]
