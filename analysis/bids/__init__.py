"""Results as a BIDS dataset: one table of answers per session, each column described, raw logs beside them."""
