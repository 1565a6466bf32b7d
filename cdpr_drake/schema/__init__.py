"""YAML files as dataclasses: fields with unit, range and documentation line, and their loader.

A schema is a dataclass with keyword arguments whose fields come from this room. Errors name file,
line, field, what was found and what is accepted. Drake's loader reads annotations themselves, so a
module with a schema does not postpone them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
