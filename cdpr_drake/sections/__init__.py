"""Sections of scenarios, a folder each: settings, blocks, columns of the log, numbers and figures.

`systems.sections` lists them and says what a section is; no other file of the core names one.
"""
