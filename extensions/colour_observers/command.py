"""`cyclopean display metamerism`."""

from runner.cli import command_of

metamerism_command = command_of(
    "extensions.colour_observers.of_files.metamerism_of_files",
    help="Print the result as JSON, every observer's difference included.",
)
