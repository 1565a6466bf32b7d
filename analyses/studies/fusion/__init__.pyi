from .statements import JUDGES as JUDGES
from .study import study_fusion as study_fusion
