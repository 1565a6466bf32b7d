"""Study: schemes of visual servoing beside each other, from the same starts.

`study_schemes` compares image-based, pose-based, 2 1/2 D, partitioned and switching servoing: turns
about the optical axis and drawn starts of a camera that moves as it is told, and approaches of
ACROBOT with a wrong model. Servoing thesis 1.4.1 says of each what it is good for.
"""

from cdpr_drake.analyses.studies.schemes.statements import JUDGES
from cdpr_drake.analyses.studies.schemes.study import SchemesStudy, study_schemes
from cdpr_drake.analyses.studies.schemes.trials import FreeCamera, RunNumbers, turned

__all__ = ["JUDGES", "FreeCamera", "RunNumbers", "SchemesStudy", "study_schemes", "turned"]
