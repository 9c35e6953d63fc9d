"""The report of a run or of a comparison: one HTML file with words first, then figures; it needs no network and no
other file.

`save_figures` writes the paper's figures of a run as files of their own.
"""

from typing import TYPE_CHECKING

from dynakin.lazy import loaded_when_asked

if TYPE_CHECKING:
    from dynakin.report.comparison_page import render_comparison
    from dynakin.report.page import render_report, write_report
    from dynakin.report.paper_figures.figures import save_figures, save_sensitivity_figures
    from dynakin.report.paper_figures.sensitivity import Sensitivity, read_sensitivity

__all__ = [
    "Sensitivity",
    "read_sensitivity",
    "render_comparison",
    "render_report",
    "save_figures",
    "save_sensitivity_figures",
    "write_report",
]

__getattr__, __dir__ = loaded_when_asked(
    __name__,
    {
        "comparison_page": ("render_comparison",),
        "page": ("render_report", "write_report"),
        "paper_figures.figures": ("save_figures", "save_sensitivity_figures"),
        "paper_figures.sensitivity": ("Sensitivity", "read_sensitivity"),
    },
)
