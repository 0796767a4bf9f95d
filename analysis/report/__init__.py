"""A report on the sessions of one experiment: a summary, a table for the terminal, a page to read and print."""

from analysis.report.page import write_report
from analysis.report.summary import Summary, summarise
from analysis.report.terminal import print_table

__all__ = ["Summary", "print_table", "summarise", "write_report"]
