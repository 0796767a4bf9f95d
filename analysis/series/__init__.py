"""The best of a series: which picture was chosen, how well it matched, and how finely the series could be told apart.

The room for everything about blocks of the kind ``best_of_series``, the thesis's first experiment [Medina2016,
Section 4.5.1]; `analysis.series.summary` brings it together.
"""
