from .statements import CHECKS as CHECKS
from .study import study_engines as study_engines
