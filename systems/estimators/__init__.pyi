from .estimator_kinds import ESTIMATORS as ESTIMATORS
from .estimator_kinds import EstimatorKind as EstimatorKind
from .estimator_kinds import EstimatorTask as EstimatorTask
from .geometry_learner import Adaptation as Adaptation
from .geometry_learner import GeometryLearner as GeometryLearner
from .pose_estimator import PoseEstimator as PoseEstimator
from .wrench_estimator import WrenchEstimation as WrenchEstimation
from .wrench_estimator import WrenchEstimator as WrenchEstimator
