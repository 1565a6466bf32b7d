"""All that was published, repeated by one command: studies run one after the other, one report.

`run_studies` runs studies of the catalogue, each in a folder of its own, and continues where it was
stopped or killed; `report_rows` puts what they found beside every published number, table, figure
and statement, see `studies.published.register.published_registers`; `write_report` makes one page
of that. The page is made of files alone, so that it is the same whether a study was run now or
before.
"""
