"""Study: two cameras, lengths, an IMU and depths fused, each failing or wrong in its turn.

Source: servoing thesis, perspectives: an onboard and an external camera, sensor fusion.
"""

from cdpr_drake.analyses.studies.fusion.statements import JUDGES
from cdpr_drake.analyses.studies.fusion.study import FusionStudy, study_fusion

__all__ = ["JUDGES", "FusionStudy", "study_fusion"]
