from .cable_behaviour import CableBehaviour as CableBehaviour
from .elastic_law import unstrained_lengths as unstrained_lengths
from .models import CABLE_MODELS as CABLE_MODELS
