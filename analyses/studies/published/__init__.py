"""What was published, as data: by section, tables of stability, the recipe that repeats them.

`published_registers` has every figure, table and statement of the theses with a result, and which
study's statement answers it.
"""
