"""What all questions share: words, results, figures, a results folder, jobs, and who follows."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
