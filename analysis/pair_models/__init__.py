"""Models of paired comparisons beyond plain Bradley-Terry: ties, order, Thurstone's law, priors, weights.

A `law` turns the difference of two strengths into chances of an answer; `cells` holds the answers as counts; `ascent`
climbs to the maximum; `existence` says beforehand whether there is one; `fit` puts them together.
"""
