"""Figures that are drawn, as files: each laid out once for all its formats, and all of them over the cores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import matplotlib as mpl
from matplotlib.backend_bases import FigureCanvasBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG

from dynakin.files import whole_file
from dynakin.progress import stage
from dynakin.report.figure import FILE_STYLE, Figure

FORMATS = ("svg", "pdf", "png")
_DPI = 300
_CANVASES: dict[str, type[FigureCanvasBase]] = {"svg": FigureCanvasSVG, "pdf": FigureCanvasPdf, "png": FigureCanvasAgg}
_DATES: dict[str, dict[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}


def save_each(figures: Mapping[str, Figure], folder: Path, formats: Sequence[str]) -> dict[str, list[Path] | Exception]:
    """Write each figure by its name; gives in their order the files of each, or what went wrong with it."""
    import joblib  # here, because it takes a quarter of a second

    jobs = min(joblib.cpu_count() - 1, len(figures))  # a worker takes seconds to start: two cores gain nothing
    save = partial(_save, folder=folder, formats=formats)
    # The largest first: it takes half of all, and the others find room next to it.
    order = sorted(figures, key=lambda name: -len(figures[name].axes))
    tasks = (joblib.delayed(save)(name, figures[name]) for name in order)
    found: dict[str, list[Path] | Exception] = {}
    with stage("saving figures") as report:
        sizes = {name: len(figures[name].axes) for name in order}
        for name, made in zip(order, joblib.Parallel(n_jobs=max(jobs, 1), return_as="generator")(tasks), strict=True):
            found[name] = made
            report(sum(sizes[name] for name in found), sum(sizes.values()))
    return {name: found[name] for name in figures}


def _save(name: str, figure: Figure, folder: Path, formats: Sequence[str]) -> list[Path] | Exception:
    written = []
    try:
        with mpl.rc_context({**FILE_STYLE, "svg.hashsalt": name}):
            _lay_out(figure)
            for form in formats:
                with whole_file(folder / f"{name}.{form}") as made:
                    _print(figure, form, made)
                written.append(folder / f"{name}.{form}")
    except Exception as error:  # one figure's is not the others'
        return error
    return written


def _lay_out(figure: Figure) -> None:
    """Find the place of all that is drawn, once for all formats: it takes as long as drawing."""
    figure.set_dpi(_DPI)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")


def _print(figure: Figure, form: str, path: Path) -> None:
    """As `Figure.savefig`, which would lay it out again and draw it twice."""
    figure.set_dpi(_DPI)  # the vector formats change it
    figure.set_facecolor(mpl.rcParams["savefig.facecolor"])
    getattr(_CANVASES[form](figure), f"print_{form}")(path, metadata=_DATES[form])
