from .statements import CHECKS as CHECKS
from .study import study_tagless as study_tagless
