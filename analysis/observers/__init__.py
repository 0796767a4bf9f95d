"""The observers: how consistent each is, how well they agree, whose answers differ, and who may be left out.

No observer is left out by default: `filters` leaves observers out by a stated rule and reports who and why.
"""
