from .drum import Drum as Drum
