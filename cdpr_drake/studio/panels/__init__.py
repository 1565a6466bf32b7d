"""The panels of the studio's page: a table, from which the page makes its tabs.

A panel's `build` places its elements into the current slot of NiceGUI. It connects to signals of
the workbench by `on_page`, which ends the connection when the page is closed.
"""

from cdpr_drake.studio.panels.panel import Panel, on_page, place_remarks
from cdpr_drake.studio.panels.table import PANELS

__all__ = ["PANELS", "Panel", "on_page", "place_remarks"]
