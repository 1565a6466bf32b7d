from .statements import JUDGES as JUDGES
from .study import study_tagless as study_tagless
