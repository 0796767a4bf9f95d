"""`cyclopean agreement`."""

from __future__ import annotations

from runner.cli import command_of

agreement_command = command_of(
    "extensions.agreement.compare.compare_with_observers",
    leave_out={"screening", "unscreened", "most_missed"},
    work=True,
)
