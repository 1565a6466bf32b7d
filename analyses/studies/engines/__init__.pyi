from .statements import JUDGES as JUDGES
from .study import study_engines as study_engines
