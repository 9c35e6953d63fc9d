"""`tune grid`: the same table whoever works and whatever is killed, its files, and what is refused."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.cli.app import main
from dynakin.errors import ConfigError, DynakinError
from dynakin.report.paper_figures.sensitivity import read_sensitivity
from dynakin.settings import presets
from dynakin.simulation.trial import simulate
from dynakin.studies.engine.journal import Journal
from dynakin.studies.engine.pools import open_pool
from dynakin.studies.tuning.grid import axis, belongs_to, combinations, paper_axes, run_grid
from dynakin.studies.tuning.score import Shared

AXES = tuple(axis(name, 1e-4, 1e4, 3) for name in ("coordinate_variance", "speed_variance", "acceleration_variance"))


def table(shared: Shared, backend: str, **options) -> tuple:
    with open_pool(backend, 2, options.pop("scheduler", None)) as pool:
        return run_grid(shared, AXES, pool, **options).cells


@pytest.fixture(scope="module")
def expected(paper: Shared) -> tuple:
    return table(paper, "threads")


def test_processes_give_the_same_table_to_the_last_digit(paper: Shared, expected: tuple) -> None:
    assert table(paper, "processes") == expected


@pytest.mark.nightly
def test_a_cluster_that_loses_a_worker_on_the_way_gives_the_same_table(paper: Shared, expected: tuple) -> None:
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "host": "127.0.0.1"}
    with distributed.LocalCluster(**options, dashboard_address=None) as cluster:
        pids = [worker.process.pid for worker in cluster.workers.values()]
        killed: list[int] = []

        def kill_one(done: int, total: int) -> None:
            if done == 5 and not killed:
                os.kill(pids[0], signal.SIGKILL)
                killed.append(pids[0])

        found = table(paper, "dask", scheduler=cluster.scheduler_address, progress=kill_one)
    assert killed and cluster.scheduler_address.startswith("tcp://")
    assert found == expected


class Stop(Exception):
    pass


def test_a_grid_that_was_stopped_goes_on_and_gives_the_same_table(
    paper: Shared, expected: tuple, tmp_path: Path
) -> None:
    def stop(done: int, total: int) -> None:
        if done == 11:
            raise Stop

    path, whose = tmp_path / "rows.jsonl", belongs_to(paper, AXES)
    with pytest.raises(Stop):
        table(paper, "threads", journal=Journal(path, whose), progress=stop)
    journal = Journal(path, whose)
    assert len(journal.rows) == 11
    assert table(paper, "threads", journal=journal) == expected


def test_cells_where_the_filter_diverges_are_empty(paper: Shared, expected: tuple) -> None:
    lost = [cell for cell in expected if cell["diverged"]]
    assert 0 < len(lost) < len(expected)
    assert all(cell["why"] and cell["paper"] is None and cell["nll"] is None for cell in lost)
    assert all(cell["why"] is None and cell["paper"] > 0.0 for cell in expected if not cell["diverged"])


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("trial") / "squat"
    simulate("sagittal7", "squat", 3, 5.0, 50.0).save(folder)
    return folder


def arguments(files: Path, output: Path) -> list[str]:
    varied = [part for name in ("speed_variance", "acceleration_variance") for part in ("--vary", f"{name}=1e-2:1e4:4")]
    trial = [str(files / "markers.trc"), "--forces", str(files / "forces.mot"), "--model", "sagittal7"]
    return ["tune", "grid", *trial, "--mass", "70", "--preset", "paper", *varied, "-o", str(output)]


@pytest.mark.nightly
def test_a_command_that_is_killed_and_started_again_gives_the_same_files(files: Path, tmp_path: Path) -> None:
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    assert main([*arguments(files, whole), "--backend", "threads"]) == 0
    code = "import sys; from dynakin.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, *arguments(files, killed), "--backend", "threads", "--jobs", "1"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    journal = killed / "rows.jsonl"
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and not (journal.exists() and journal.read_text().count("\n") > 3):
        time.sleep(0.005)
    process.kill()
    process.wait()
    assert journal.read_text().count("\n") > 3
    assert main([*arguments(files, killed), "--backend", "threads"]) == 0
    names = {file.name for file in whole.iterdir()}
    assert names >= {"grid.csv", "grid.json", "preset_paper.toml", "figure3_paper.png", "figure3_nll.svg"}
    for name in names - {"rows.jsonl"}:
        assert (killed / name).read_bytes() == (whole / name).read_bytes(), name


@pytest.mark.nightly
def test_the_optimum_is_a_preset_that_run_takes(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "grid"
    assert main([*arguments(files, folder), "--backend", "threads"]) == 0
    optimum = json.loads((folder / "grid.json").read_text())["optimum"]["nll"]
    noise = presets.preset(str(folder / "preset_nll.toml"))
    assert (noise.speed_variance, noise.acceleration_variance) == (
        optimum["speed_variance"],
        optimum["acceleration_variance"],
    )
    assert noise.changed(speed_variance=1e2, acceleration_variance=1e3) == presets.paper()
    with (folder / "grid.csv").open(newline="") as file:
        cells = list(csv.DictReader(file))
    assert min((c for c in cells if c["nll"]), key=lambda c: float(c["nll"]))["speed_variance"] == repr(
        optimum["speed_variance"]
    )
    trial = [str(files / "markers.trc"), "--forces", str(files / "forces.mot"), "--model", "sagittal7"]
    out = tmp_path / "out"
    run = ["run", *trial, "--mass", "70", "-o", str(out), "--preset"]
    assert main([*run, str(folder / "preset_paper.toml")]) == 0
    metrics, optimum = (json.loads(path.read_text()) for path in (out / "metrics.json", folder / "grid.json"))
    expected = optimum["optimum"]["paper"]["nis_per_row"]
    assert metrics["consistency"]["mean_nis_per_dof"] == pytest.approx(expected, rel=1e-6)
    # The likeliest cell of this grid trusts the motion so much that markers lie 40 to 65 mm off: no estimate.
    assert main([*run, str(folder / "preset_nll.toml")]) == 1
    assert "the person was lost" in capsys.readouterr().err


def test_the_table_of_the_papers_gains_is_figure_3s_file(paper: Shared, tmp_path: Path) -> None:
    from dynakin.studies.tuning.output import write_grid

    with open_pool("threads", 2) as pool:
        grid = run_grid(paper, AXES, pool)
    write_grid(tmp_path, grid, "paper")
    read = read_sensitivity(tmp_path / "grid.csv")
    np.testing.assert_array_equal(read.criterion, grid.criterion("paper"))
    best = grid.best("paper")
    at = [10.0 ** axis[k] for axis, k in zip(read.gains, read.optimum, strict=True)]
    assert at == pytest.approx([best[axis.name] for axis in AXES])


def test_the_papers_grid_is_13_values_of_three_gains() -> None:
    axes = paper_axes()
    assert [axis.name for axis in axes] == ["coordinate_variance", "speed_variance", "acceleration_variance"]
    assert all(axis.values == tuple(float(f"1e{k}") for k in range(-6, 7)) for axis in axes)
    assert len(combinations(axes)) == 2197


@pytest.mark.parametrize(
    ("name", "span", "expected"),
    [
        ("jerk_density", (1.0, 10.0, 2), "did you mean 'jerk_density_rad2_s5'"),
        ("jerk_density_rad2_s5", (0.0, 10.0, 2), "expected 0 < from < to"),
        ("jerk_density_rad2_s5", (10.0, 1.0, 2), "expected 0 < from < to"),
        ("jerk_density_rad2_s5", (1.0, 10.0, 1), "2 steps or more"),
    ],
)
def test_a_range_that_is_none_is_refused(name: str, span: tuple, expected: str) -> None:
    with pytest.raises(ConfigError, match=expected):
        axis(name, *span)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--vary", "jerk_density_rad2_s5"], "--vary: found 'jerk_density_rad2_s5', expected NAME=FROM:TO:STEPS"),
        (["--vary", "jerk_density_rad2_s5=1:1e4:100000000"], "100000000 steps, expected at most 1000000"),
        (
            ["--vary", "jerk_density_rad2_s5=1:9:9999", "--vary", "force_variance_n2=1:9:9999"],
            "combinations, expected at most 1000000",
        ),
        (["--vary", "speed_variance=1:10:2"], "each once"),
        (["--backend", "dask"], "--scheduler ADDRESS"),
        (["--preset", "papr"], "preset 'papr' is unknown"),
    ],
)
def test_bad_options_are_said_in_one_line(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], expected: str
) -> None:
    assert main([*arguments(files, tmp_path / "out"), *options]) == 2
    error = capsys.readouterr().err
    assert expected in error and error.count("\n") == 1


def test_a_folder_of_something_else_is_left_alone(files: Path, tmp_path: Path) -> None:
    (tmp_path / "thesis.doc").write_text("years of work")
    assert main(arguments(files, tmp_path)) == 2
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.doc"]


def test_all_diverged_is_said(paper: Shared) -> None:
    """Variances so large that no factor of the covariance is left (gains of nothing fail only by rounding)."""
    axes = [axis(name, 1e40, 1e41, 2) for name in ("coordinate_variance", "speed_variance", "acceleration_variance")]
    still = replace(paper, base=paper.base.changed(marker_place_variance_m2=0.0))
    with open_pool("threads", 2) as pool:
        grid = run_grid(still, axes, pool)
    with pytest.raises(DynakinError, match="diverged in all of the 8 combinations"):
        grid.best("paper")
