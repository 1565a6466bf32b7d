"""Robots and mechanisms in the files of other tools: read into drafts, completed, and written.

A `RobotDraft` holds what a file says, in SI units and frames W and P; `complete_draft` makes the
content of a robot file of it and says what the file lacked and what was assumed. Readers never
guess silently: what they leave out or read otherwise is a remark of the draft. The loader checks
that text as any other; `models.load_robot` reads files of other tools so for every command.

A reader wraps its document by `watched`, which records what is asked for, and `not_kept` names the
rest; where Drake or MuJoCo reads the file, the reader marks what these took. Writers go the same
way back: `draft_robot`, then a writer. `HELD` says which keys of the schema a format holds;
`export_omissions` walks over the schema and names every other one that the robot gives. CASPR's
models of several links are a `CasprTree` instead, from and to a mechanism by `mechanism_exchange`.

Source: each reader's module.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
