"""What a file means before anyone sits down: read it with all it names, and say what a session would be."""

from runner.check.checked import Checked, Wishes
from runner.check.files import check_file

__all__ = ["Checked", "Wishes", "check_file"]
