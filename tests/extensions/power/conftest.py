"""What tests of power share with those of designs."""

from tests.runner.reports.test_designs import scenes

__all__ = ["scenes"]
