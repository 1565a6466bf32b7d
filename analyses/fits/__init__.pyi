from .fit import Fit as Fit
from .fit import Unknown as Unknown
