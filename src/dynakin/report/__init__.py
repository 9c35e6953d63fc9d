"""The report of a run: one HTML file with words first, then figures; it needs no network and no other file."""

from dynakin.report.page import render_report, write_report

__all__ = ["render_report", "write_report"]
