"""Who answers: a person at the keys, or a simulation with known scores."""
