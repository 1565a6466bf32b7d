"""How large errors may be before a servo's stability is lost: each combination a question.

Every question has its own name, depends on no other, and is answered with a few numbers.

Source: servoing thesis 3.2 and 3.4.2.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
