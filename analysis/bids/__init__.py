"""Export of results as a BIDS dataset: a table of answers per session, sidecars for its columns, and the raw logs."""
