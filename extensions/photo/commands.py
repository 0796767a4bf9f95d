"""`cyclopean camera bracket` and `cyclopean camera fit`."""

from __future__ import annotations

from runner.cli import command_of

bracket_command = command_of("extensions.photo.bracket.bracket_photographs", leave_out={"exposure"})
fit_command = command_of("extensions.photo.page.characterise_camera")
