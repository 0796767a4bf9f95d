"""A report on the sessions of one experiment: a summary, a table for the terminal, a page to read and print."""

from analysis.report.page import write_report
from analysis.report.report import Report, describe
from analysis.report.summary import Summary, summarise
from analysis.report.terminal import print_report, print_table

__all__ = ["Report", "Summary", "describe", "print_report", "print_table", "summarise", "write_report"]
