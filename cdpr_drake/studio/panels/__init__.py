"""The panels of the studio's page: a table, from which the page makes its tabs.

* `PANELS` is the table. A panel's `build` places its elements into the current slot of NiceGUI. It
  connects to signals of the workbench by `on_page`, which ends the connection when the page is
  closed.
* What several panels are made of: messages, forms from schemas, tables with bars. `show_errors`
  shows what a handler raises as a message in the page. `SchemaGroups` is the form of a document,
  made from its schema: units, ranges, errors beside the fields. `cable_table` and `fact_table` are
  HTML, one element for many numbers.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
