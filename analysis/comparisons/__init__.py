"""Tables of paired comparisons: who was preferred over whom, how often, by which observer."""
