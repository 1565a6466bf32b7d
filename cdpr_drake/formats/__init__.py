"""Robots and mechanisms in the files of other tools: read into drafts, completed, and written.

A `RobotDraft` holds what a file says, in SI units and frames W and P; `complete_draft` makes the
content of a robot file of it and says what the file lacked and what was assumed. Readers never
guess silently: what they leave out or read otherwise is a remark of the draft.

Source: each reader's module.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
