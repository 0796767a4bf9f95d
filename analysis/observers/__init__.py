"""The observers themselves: how consistent each is, how well they agree, who differs, and who may be left out.

Nothing here drops an observer on its own: `filters` does so by a rule that is stated, and says who and why.
"""
