from .estimator_kinds import ESTIMATORS as ESTIMATORS
from .estimator_kinds import EstimatorKind as EstimatorKind
from .estimator_kinds import EstimatorTask as EstimatorTask
from .pose_estimator import PoseEstimator as PoseEstimator
from .pose_estimator import Read as Read
