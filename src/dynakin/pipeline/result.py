"""What a run gives, and its output folder: written as one, so that all files are there or what was there before."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dynakin.errors import ConfigError, OutputError
from dynakin.files import expanded, write_json
from dynakin.identification.observability.trial import Identifiability
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.progress import stage
from dynakin.results.estimate import Estimate
from dynakin.results.failures import LOG, Failures
from dynakin.results.files import body as body_files
from dynakin.results.files import motion as motion_files
from dynakin.results.files.config import write_config, write_parameters
from dynakin.results.files.folder import replacing
from dynakin.results.files.markers import write_markers
from dynakin.results.files.netcdf import write_netcdf
from dynakin.results.measures.mean_curves import curve_points, estimate_curves, write_curves
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.repetitions import Repetition, repetitions_of
from dynakin.results.measures.tracking import refuse_lost
from dynakin.results.records import Event
from dynakin.settings.settings import Settings
from dynakin.settings.strict import nearest
from dynakin.validation.methods import ComparedTrial

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from dynakin.report.figure import Figure
    from dynakin.report.paper_figures.sensitivity import Sensitivity


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """What `dynakin.run` found. ``Result(estimate)`` alone can be saved too.

    Attributes:
        model: as it was calibrated on the recording, where the filter started.
        comparison: the estimate against the reference methods; None where that stage failed or was not asked for.
        observability: what the recording says of the constants, and what motion would say more; None as above, and
            where it would take too long (a message of the estimate says so).
        settings: that were asked for; ``estimate.config`` has them as used.
        failures: late stages that failed (a figure, the page, observability): all else is there.
    """

    estimate: Estimate
    model: CalibratedModel | None = None
    comparison: ComparedTrial | None = None
    observability: Identifiability | None = None
    settings: Settings | None = None
    failures: Failures = field(default_factory=Failures)

    def __repr__(self) -> str:
        failed = f", {len(self.failures.found)} late stages failed" if self.failures.found else ""
        return f"<Result: {self.estimate!r}{failed}>"

    def _repr_html_(self) -> str:
        from dynakin.report.page import render_summary  # Jinja: only who looks waits

        return render_summary(self.estimate, self.metrics())

    @property
    def events(self) -> list[Event]:
        """Markers that were missing or refused, bounds reached, resets."""
        return self.estimate.events

    @property
    def cycles(self) -> list[Repetition]:
        """Whole squats or gait cycles after the adaptation, in the order of time; the report says why none are."""
        return list(repetitions_of(self.estimate).items)

    def to_dataframe(self, quantity: str = "coordinates") -> pd.DataFrame:
        """A quantity of ``estimate.data`` over time, a column a name: coordinates (rad, m), speeds, moments (N m, N),
        each with ``_sd``, ``state``, ``wrench_estimated``, ...

        Raises:
            ConfigError: no such quantity, or it is no table over time.
        """
        known = [str(name) for name in self.estimate.data]
        if quantity not in known:
            near = nearest(quantity, known) if isinstance(quantity, str) else ""
            raise ConfigError(f"to_dataframe: no quantity {quantity!r}{near}, expected one of {', '.join(known)}")
        data = self.estimate.data[quantity]
        if not _is_table(data):
            tables = [name for name in known if _is_table(self.estimate.data[name])]
            raise ConfigError(
                f"to_dataframe: {quantity} has the dimensions {', '.join(map(str, data.dims))}, expected time and one "
                f"other, as {', '.join(tables)} have; estimate.data has it as it is"
            )
        return data.transpose("time", ...).to_pandas()

    def plot(self, figure: str = "angles") -> Figure:
        """One of the figures that `save_figures` writes, as a Matplotlib figure; a notebook shows it.

        Args:
            figure: "angles", "moments" (all joints, with their bands, derived values dashed, priors dotted), "wrench",
                "markers", "knee_moment", "lengths_and_masses", "inertias", "repetitions_angles",
                "repetitions_moments" or "repetitions_wrench".

        Raises:
            ConfigError: no such figure, or this run has nothing to show in it.
        """
        from dynakin.report.paper_figures.figures import draw_figure  # Matplotlib: only who draws waits

        return draw_figure(figure, self.estimate, self.comparison)

    def metrics(self) -> dict[str, Any]:
        """What ``metrics.json`` holds: the figures (see `dynakin.results.measures.metrics`; computed once, a copy is
        given), ``messages``, and ``failures``, the stages that failed by now. A figure that cannot be had is None, and
        stands there."""
        figures = deepcopy(self._metrics)
        messages = [*self.estimate.messages, *self.failures.messages()]
        return figures | {
            "messages": list(map(str, messages)),
            "failures": [failure.stage for failure in self.failures.found],
        }

    @cached_property
    def _metrics(self) -> dict[str, Any]:
        metrics = compute_metrics(self.estimate, self.failures)
        if self.observability is not None:
            with self.failures.stage("observability of the constants"):
                metrics["identifiability"] = self.observability.as_dict()
        return metrics

    def save(
        self,
        folder: str | Path | None = None,
        *,
        overwrite: bool = True,
        keep_lost: bool = False,
        figures: str | Path | None = None,
        check: bool = True,
    ) -> Path:
        """Write every output file into ``folder`` (that of the settings where not given) and return it.

        All files are first written into a temporary folder next to it, which then takes its place: a failure leaves
        what was there. A folder that exists is replaced only if ``overwrite`` is true and it is empty or holds
        nothing but an earlier output of dynakin.

        Args:
            keep_lost: write a trial that was lost too, its lost frames empty.
            figures: folder for figures for papers (`save_figures`), in addition.
            check: raise where a stage failed, once all else is written; else see ``failures``.

        Raises:
            LostError: the person was lost for so long that the trial is no estimate, and ``keep_lost`` is false:
                nothing is written.
            OutputError: no folder is given, or it cannot be written or holds something else; with ``check`` also where
                some stage failed: all else is saved then.
        """
        if folder is None:
            folder = None if self.settings is None or self.settings.output == Path() else self.settings.output
        if folder is None:
            raise OutputError("save: no folder was given, expected save(FOLDER) or run(..., output=FOLDER)")
        folder = expanded(folder)
        if not keep_lost:
            refuse_lost(self.estimate, "keep_lost=True")
        self._write(folder, overwrite)
        if figures is not None:
            known = len(self.failures.found)
            with self.failures.stage("figures"):
                self.save_figures(figures)
            if len(self.failures.found) > known:  # they are to stand in the files too
                with self.failures.stage("what failed, in the files"):  # these stay as they were saved
                    self._write(folder, overwrite=True)
        if check and self.failures.found:
            said = " ".join(map(str, self.failures.messages()))
            raise OutputError(f"{folder}: the results are saved ({LOG} has details). {said}")
        return folder

    def save_figures(
        self, folder: str | Path, formats: Sequence[str] | None = None, *, sensitivity: Sensitivity | None = None
    ) -> list[Path]:
        """Write the paper's figures of this run into ``folder`` (see `dynakin.report.save_figures`);
        one that fails stands in ``failures``.

        Args:
            formats: some of svg, pdf, png; None: all.
            sensitivity: a criterion over the gains, the paper's Figure 3.

        Returns:
            The files written.

        Raises:
            ConfigError: an unknown format. OutputError: the folder cannot be written.
        """
        from dynakin.report.paper_figures.figures import save_figures  # as above
        from dynakin.report.paper_figures.saving import FORMATS

        return save_figures(
            self.estimate,
            folder,
            FORMATS if formats is None else formats,
            comparison=self.comparison,
            sensitivity=sensitivity,
            failures=self.failures,
        )

    def _write(self, folder: Path, overwrite: bool) -> None:
        estimate, failed, metrics = self.estimate, self.failures, self.metrics()
        if self.settings is not None:
            estimate = replace(estimate, config=estimate.config | {"output": str(folder.absolute())})
        files: dict[str, Callable[[Estimate, Path], None]] = {
            "coordinates.mot": motion_files.write_coordinates,
            "speeds.sto": motion_files.write_speeds,
            "accelerations.sto": motion_files.write_accelerations,
            "moments.sto": motion_files.write_moments,
            "moments_source.sto": motion_files.write_moment_sources,
            "wrench.sto": motion_files.write_wrench,
            "uncertainty.sto": motion_files.write_deviations,
            "markers.trc": write_markers,
            "parameters.json": write_parameters,
            "estimate.nc": write_netcdf,
        }
        with stage("writing results and report") as report, replacing(folder, overwrite=overwrite) as made:
            in_all = len(files) + 2  # the page takes longest
            for done, (name, write) in enumerate(files.items()):
                report(done, in_all)
                _written(made / name, failed, lambda path, write=write: write(estimate, path))  # type: ignore[misc]
            with failed.stage("files of the body", writes=True):
                body_files.write_body_files(estimate, made)
            report(len(files), in_all)
            _written(made / "repetitions.csv", failed, self._write_repetitions)
            write_config(estimate.config, made / "config.toml")
            whole = replace(estimate, messages=[*estimate.messages, *failed.messages()])
            report(len(files) + 1, in_all)
            _written(
                made / "report.html",
                failed,
                lambda path: self._write_page(whole, metrics, path),
            )
            write_json(made / "metrics.json", self.metrics())
            if failed.found:
                (made / LOG).write_text(failed.log(), encoding="utf-8", newline="\n")

    def _write_page(self, estimate: Estimate, metrics: dict[str, Any], path: Path) -> None:
        from dynakin.report.page import write_report  # as above

        write_report(estimate, path, metrics=metrics, comparison=self.comparison)

    def _write_repetitions(self, path: Path) -> None:
        curves = estimate_curves(self.estimate) if self.comparison is None else self.comparison.curves()
        write_curves(path, curve_points(self.estimate.recording.name, curves))


def _is_table(data: xr.DataArray) -> bool:
    return len(data.dims) == 2 and "time" in data.dims


def _written(path: Path, failed: Failures, write: Callable[[Path], None]) -> None:
    """One file, or none: half a file looks like a whole one."""
    done = False
    with failed.stage(path.name, writes=True):
        write(path)
        done = True
    if not done:
        path.unlink(missing_ok=True)
