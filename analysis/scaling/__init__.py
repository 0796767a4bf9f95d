"""From paired comparisons to scores: models, maximum likelihood, standard errors."""
