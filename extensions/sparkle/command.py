"""`cyclopean stimuli contrast`."""

from runner.cli import command_of

contrast_command = command_of("extensions.sparkle.contrast.contrast")
