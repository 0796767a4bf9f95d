"""The parts of a session: coroutines that yield what to ask and what to record, and are independent of screens."""
