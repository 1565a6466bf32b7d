from .statements import CHECKS as CHECKS
from .study import study_fusion as study_fusion
