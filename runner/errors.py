"""What can go wrong in a session."""

from documents import InputError


class SessionError(InputError):
    """A session was asked for that cannot be run as it was asked for."""


class SessionStoppedError(RuntimeError):
    """A session stopped: an answer could not be written, or the gamma table changed; all before it is on disk."""
