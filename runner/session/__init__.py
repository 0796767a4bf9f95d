"""Running a session: the engine, the record it writes, and the station where observers sit down."""
