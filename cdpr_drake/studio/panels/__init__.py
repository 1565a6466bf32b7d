"""The studio's panels, and what several of them are made of: forms, tables with bars, plots.

A panel is a row of `studio.panel.PANELS`: a function that places its elements into the current slot
of NiceGUI. It connects to signals of the workbench by `on_page`, which ends the connection when the
page is closed, and what its handlers raise is shown as a message by `show_errors`.
"""
