"""What a file means before a session: read it with everything it names, and report what a session would be."""
