"""Study: servoing on textured squares without tags beside tags of the same size.

`study_tagless` runs ACROBOT's approach in rendered images from starts that are drawn, on a tag and
on each texture, by three schemes, and compares where the platform comes to rest with where it
should be.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
