"""The report of a run: one HTML file with words first, then figures; it needs no network and no other file.

`save_figures` writes the paper's figures of a run as files of their own.
"""

from dynakin.report.figures import save_figures
from dynakin.report.page import render_report, write_report

__all__ = ["render_report", "save_figures", "write_report"]
