"""What marks are sent to, and what can go wrong with it."""

from __future__ import annotations

from typing import Literal, Protocol, TypeAlias

from devices.errors import DeviceError

Event: TypeAlias = Literal["onset", "answer"]
Code: TypeAlias = int | str


class MarkError(DeviceError):
    """A port cannot be opened, or did not take this mark; another mark may go through."""


class PortLostError(MarkError):
    """The port is gone, such as an adapter that was pulled out: no mark will go through any more."""


class MarkPort(Protocol):
    """An open port. Nothing that is done to it waits for whatever reads from it."""

    @property
    def is_heard(self) -> bool:
        """Whether something reads what is sent; True also where no port could tell."""

    def send(self, code: Code, event_s: float, trial_byte: int | None = None) -> None:
        """Send ``code`` for what happened at ``event_s`` of ``time.monotonic``, without waiting.

        ``trial_byte`` follows it, 0 to 255, where the port takes two bytes. Raises MarkError if it could not be sent:
        PortLostError if no other will be either.
        """

    def close(self) -> None:
        """Close the port. Pins and lines are left at 0."""
