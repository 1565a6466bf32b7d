"""The studio: a local web page for robots, poses, workspaces, runs and studies.

`serve` starts it. Its packages, from the bottom: `workbench` (what a browser session works on, and
work in child processes), `panels` (a table of the page's panels, with their messages, fields and
bars). Only this package and `panels` know NiceGUI. Every session has a workbench of its own; all
sessions share the server's jobs, so that a reload or a second tab loses no run.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
