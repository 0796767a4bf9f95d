"""The records of sessions: the format of `session.jsonl`, and reading results."""
