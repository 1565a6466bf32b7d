"""How large errors may be before a servo's stability is lost: combinations of limits, item by item.

Every item is one question with its own name, depends on no other, and answers with a few numbers.
"""
