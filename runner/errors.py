"""What can go wrong in a session."""

from documents import Finding, InputError, WorkError


class SessionError(InputError):
    """A session was asked for that cannot be run as it was asked for."""


class SessionStoppedError(WorkError):
    """A session stopped: an answer could not be written, or the gamma table changed; all before it is on disk."""


class UsedCodeError(SessionError):
    """An observer's code has a finished session: ``what`` says when, and ``again`` how to have another."""

    def __init__(self, what: str, file: str, again: str) -> None:
        self.what = what
        super().__init__([Finding(what, file, remedy="give the code of who sits now"), Finding(again)])
