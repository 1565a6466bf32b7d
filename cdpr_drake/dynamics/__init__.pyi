from .explicit_kernel import METHODS as METHODS
from .tracking_kernel import track as track
