"""Study: a tag on a mobile robot that goes round, followed until that fails, or for three hours.

Every estimator of the platform's pose without a known tag (servoing thesis 2.3.7), and with a
known tag once a lap, without and with tension correction (5.3.1).
"""

from cdpr_drake.analyses.studies.mobile_robot.figures import FIGURES
from cdpr_drake.analyses.studies.mobile_robot.judges import JUDGES
from cdpr_drake.analyses.studies.mobile_robot.study import MobileRobotStudy, study_mobile_robot

__all__ = ["FIGURES", "JUDGES", "MobileRobotStudy", "study_mobile_robot"]
