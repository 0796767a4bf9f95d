"""`cyclopean export`."""

from __future__ import annotations

from runner.cli import command_of

export_command = command_of("extensions.bids.results.export_results", leave_out={"facts"})
