"""The records of sessions: what stands in `session.jsonl`."""
