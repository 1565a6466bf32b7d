"""The studio: a local web page for robots, poses, workspaces, runs and studies.

`serve` starts it. Rooms, from the bottom: `jobs` (work in child processes), `workbench` (what a
browser session works on), `widgets` (messages, fields, bars), `panels` (a table of the page's
panels). Only this room, `widgets` and `panels` know NiceGUI. Every session has a workbench of its
own; all sessions share the server's jobs, so that a reload or a second tab loses no run.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
