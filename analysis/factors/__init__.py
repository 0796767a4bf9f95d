"""What the stimuli's factors, such as view and exposure, do to the scores: strengths θ = X β [Springall1973].

`values` reads what the stimuli say of themselves; `terms` turns a factor into columns of X; `aliasing` chooses those
that can be told apart; `existence` says beforehand whether a maximum exists; `ascent` climbs to it; `likelihood_ratio`
and `explained` hold models against each other; `effects` puts all together; `figure` draws.
"""
