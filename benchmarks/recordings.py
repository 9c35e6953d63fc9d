"""Every recording of ``../shared/data`` through the command line as a user would; its moments against the files' own.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/recordings.py [NAME...] [--jobs 2] [--write]

Each runs with its own .osim, else ``fullbody``, and no option but the mass, the forces and the standing trial that
belong to it. What is measured, derived, prior and absent is what ``estimate.nc`` says (``moment_source``). Runs are
kept in ``build/recordings`` by their inputs and the source, so that the table can be made again. ``--write`` puts the
tables into ``docs/validation/recordings.md``.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pages import put
from recordings_references import JOINTS, SIDES, Array, Inverse, Reference, bodies_under, of_c3d, of_storage

from dynakin.results.measures.sources import MEANINGS, MEASURED
from dynakin.studies.engine.build import build

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("DYNAKIN_TEST_DATA", ROOT.parent / "shared" / "data"))
KEPT = ROOT / "build" / "recordings"
LIMIT_S = 1800.0
SHOWN = 240  # characters of a refusal
Make = Callable[[], Reference]
Codes = NDArray[np.integer]


@dataclass(frozen=True)
class Trial:
    """A recording with what belongs to it; paths within the data's folder."""

    path: str
    mass_kg: float | None
    forces: str | None = None
    static: str | None = None
    osim: str | None = None
    reference: Make | None = None
    filtered: Make | None = None  # the same with forces low-passed as its motion

    @property
    def name(self) -> str:
        return self.path.rsplit(".", 1)[0]

    def model(self, wanted: str) -> str:
        return str(DATA / self.osim) if self.osim and wanted != "fullbody" else "fullbody"

    def inputs(self) -> list[Path]:
        return [DATA / name for name in (self.path, self.forces, self.static, self.osim) if name]


def _opencap(name: str, hz: float | None) -> Trial:
    folder, model = "opencap_subject4", "optimized_scale_and_markers.osim"

    def make(filtered: bool) -> Reference:
        assert hz is not None
        root = DATA / folder
        files = [root / f"{name}{end}" for end in ("_ik.mot", "_external_forces.xml", "_grf.mot")]
        inverse = Inverse(files[0], root / model, files[1], files[2], hz, bodies_under(root, name))
        return inverse.run(KEPT / f"id_{name}{'_filtered' * filtered}", filtered=filtered)

    forces = f"{folder}/{name}_grf.mot"
    static = None if name == "static1" else f"{folder}/static1.trc"
    makes = (lambda: make(False), lambda: make(True)) if hz else (None, None)
    return Trial(f"{folder}/{name}.trc", 60.05, forces, static, f"{folder}/{model}", *makes)


def _filtered(motion: str, model: str, loads: str, forces: str, hz: float) -> Make:
    paths = [DATA / part for part in (motion, model, loads, forces)]
    return lambda: Inverse(*paths, hz).run(KEPT / f"id_{Path(motion).stem}_filtered", filtered=True)


def _c3d(path: str, mass_kg: float, static: str | None = None, moments: bool = False) -> Trial:
    return Trial(path, mass_kg, None, static, None, (lambda: of_c3d(DATA / path, mass_kg)) if moments else None)


def _storage(file: str, start_s: float, end_s: float, what: str) -> Make:
    return lambda: of_storage(DATA / file, (start_s, end_s), what)


_R, _G, _F, _C, _P = "rajagopal", "gait2354", "c3d_parser/FMC", "c3d_parser", "plugin_gait"
TRIALS = (
    _opencap("static1", None),
    _opencap("squats1", 6.0),
    _opencap("walking1", 6.0),
    _opencap("STS1", 6.0),
    _opencap("DJ1", 15.0),
    Trial(
        f"{_R}/motion_capture_run.trc",
        72.84,
        f"{_R}/grf_run.mot",
        f"{_R}/static_run.trc",
        f"{_R}/subject_scaled_run.osim",
        _storage(f"{_R}/run_id.sto", 0.4, 5.1, "OpenSim's inverse dynamics, 15 Hz"),
        _filtered(
            f"{_R}/run_ik.mot",
            f"{_R}/subject_scaled_run.osim",
            f"{_R}/grf_run_external_forces.xml",
            f"{_R}/grf_run.mot",
            15.0,
        ),
    ),
    Trial(
        f"{_R}/motion_capture_walk.trc",
        85.07,
        f"{_R}/grf_walk.mot",
        f"{_R}/static_walk_1.trc",
        f"{_R}/subject_scaled_walk.osim",
        _storage(f"{_R}/walk_id.sto", 0.45, 1.8, "OpenSim's inverse dynamics, 6 Hz, 0.45 to 1.8 s"),
        _filtered(
            f"{_R}/walk_ik.mot",
            f"{_R}/subject_scaled_walk.osim",
            f"{_R}/grf_walk_external_forces.xml",
            f"{_R}/grf_walk.mot",
            6.0,
        ),
    ),
    Trial(f"{_R}/static_run.trc", 72.84, None, None, f"{_R}/subject_scaled_run.osim"),
    Trial(f"{_R}/static_walk_1.trc", 85.07, None, None, f"{_R}/subject_scaled_walk.osim"),
    Trial(f"{_R}/static_walk_2.trc", 85.07, None, None, f"{_R}/subject_scaled_walk.osim"),
    Trial(
        f"{_G}/subject01_walk1.trc",
        72.6,
        f"{_G}/subject01_walk1_grf.mot",
        f"{_G}/subject01_static.trc",
        f"{_G}/subject01_simbody.osim",
        _storage(f"{_G}/inverse_dynamics.sto", 0.4, 1.6, "OpenSim's inverse dynamics as shipped, 6 Hz"),
        _filtered(
            f"{_G}/subject01_walk1_ik.mot",
            f"{_G}/subject01_simbody.osim",
            f"{_G}/subject01_walk1_grf.xml",
            f"{_G}/subject01_walk1_grf.mot",
            6.0,
        ),
    ),
    Trial(f"{_G}/subject01_static.trc", 72.6, None, None, f"{_G}/subject01_simbody.osim"),
    _c3d(f"{_P}/GaitNormal_1.c3d", 66.0),
    _c3d(f"{_P}/S1_StandingRef.c3d", 78.6),
    _c3d(f"{_P}/S1_FlywheelSquat.c3d", 78.6, f"{_P}/S1_StandingRef.c3d"),
    _c3d(f"{_F}/MH0222_BP01.c3d", 81.0),
    _c3d(f"{_F}/MH0222_BP06.c3d", 81.0, f"{_F}/MH0222_BP01.c3d", moments=True),
    _c3d(f"{_F}/MH0222_BP08.c3d", 81.0),
    _c3d(f"{_F}/MH0222_BP15.c3d", 81.0, f"{_F}/MH0222_BP08.c3d", moments=True),
    _c3d(f"{_C}/MH/MH_Cal 01.c3d", 79.25),
    _c3d(f"{_C}/MH/MH_Dynamic_BF08.c3d", 79.25, f"{_C}/MH/MH_Cal 01.c3d", moments=True),
    _c3d(f"{_C}/RBWH/Max Cal 01.c3d", 57.0),
    _c3d(f"{_C}/RBWH/bfnd w1.c3d", 57.0, f"{_C}/RBWH/Max Cal 01.c3d", moments=True),
    _c3d("pycgm/Static_trial.c3d", 85.0),
    _c3d("pycgm/Movement_trial.c3d", 85.0, "pycgm/Static_trial.c3d", moments=True),
    _c3d("functional/anat_pose_ECH.c3d", 66.0),
    _c3d("functional/right_hip.c3d", 66.0, "functional/anat_pose_ECH.c3d"),
    _c3d("functional/right_knee.c3d", 66.0, "functional/anat_pose_ECH.c3d"),
)


@dataclass(frozen=True, eq=False)
class Run:
    """What the command line did: its exit code, its first line of what is wrong, the folder where it left results."""

    trial: Trial
    model: str
    code: int
    said: str
    seconds: float
    folder: Path

    @property
    def data(self) -> xr.Dataset | None:
        file = self.folder / "estimate.nc"
        if not file.exists():
            return None
        with xr.open_dataset(file) as data:
            return data.load()


def run(trial: Trial, wanted: str, source: str) -> Run:
    """One recording through ``dynakin run``, or what was kept of it."""
    model = trial.model(wanted)
    options = ["--model", model]
    for option, value in (("--forces", trial.forces), ("--static", trial.static)):
        options += [option, str(DATA / value)] if value else []
    options += ["--mass", str(trial.mass_kg)] if trial.mass_kg else []
    code, said, seconds, folder = kept(DATA / trial.path, options, trial.inputs(), source)
    return Run(trial, Path(model).name, code, said, seconds, folder)


def kept(path: Path, options: list[str], inputs: list[Path], source: str) -> tuple[int, str, float, Path]:
    """Exit code, first line of what went wrong, seconds and output folder of ``dynakin run``, run or kept before.

    Args:
        inputs: files on which the results depend. source: digest of the package.
    """
    name = path.relative_to(DATA).with_suffix("") if path.is_relative_to(DATA) else Path(path.parent.name, path.stem)
    digest = hashlib.sha256(json.dumps([source, str(name) + path.suffix, options]).encode())
    for each in inputs:
        digest.update(each.read_bytes() if each.exists() else b"")
    made = KEPT / f"{str(name).replace('/', '_').replace(' ', '_')}-{digest.hexdigest()[:12]}"
    told = made / "run.json"
    if not told.exists():
        made.mkdir(parents=True, exist_ok=True)
        command = [str(Path(sys.executable).with_name("dynakin")), "run", str(path), *options]
        start = time.perf_counter()
        try:
            done = subprocess.run(
                [*command, "-o", str(made / "out")],
                capture_output=True,
                text=True,
                timeout=LIMIT_S,
                check=False,
                env=os.environ | {"COLUMNS": "10000", "NO_COLOR": "1"},
            )
            code, out, err = done.returncode, done.stdout, done.stderr
        except subprocess.TimeoutExpired:
            code, out, err = -1, "", f"not done within {LIMIT_S:g} s"
        (made / "stdout.txt").write_text(out, encoding="utf-8")
        (made / "stderr.txt").write_text(err, encoding="utf-8")
        content = {"code": code, "said": _first_line(err, out), "seconds": time.perf_counter() - start}
        told.write_text(json.dumps(content), encoding="utf-8")
    content = json.loads(told.read_text(encoding="utf-8"))
    return content["code"], content["said"], content["seconds"], made / "out"


def _first_line(err: str, out: str) -> str:
    """The first line of what went wrong, without the data's folder."""
    lines = [line.strip(" │") for text in (err, out) for line in text.splitlines() if line.strip(" │╭╮╰╯─")]
    line = lines[0].replace(f"{DATA}/", "") if lines else ""
    return line if len(line) <= SHOWN else line[: line.rfind(" ", 0, SHOWN)] + " ..."


def sources(data: xr.Dataset) -> dict[str, Codes] | None:
    """Side -> (T,) the worst code of hip, knee and ankle; None where the run does not declare any."""
    if "moment_source" not in data:
        return None
    codes = data["moment_source"].transpose("time", "coordinate")
    names = [str(name) for name in codes["coordinate"].values]
    return {
        side: codes.values[:, [names.index(f"{name}_{letter}") for name in JOINTS.values()]].max(axis=1)
        for side, letter in SIDES.items()
    }


@dataclass(frozen=True)
class Agreement:
    """What is measured against a reference: frames, RMS (N m), slope of ours over theirs, Pearson's correlation."""

    frames: int
    rms: float
    slope: float
    r: float

    @property
    def cells(self) -> str:
        return f"{self.frames} | {self.rms:.1f} | {self.slope:.2f} | {self.r:.2f}"

    @property
    def short(self) -> str:
        return f"{self.rms:.1f}, {self.slope:.2f}, {self.r:.2f}"


def agreement(ours: Array, theirs: Array) -> Agreement | None:
    """Over the frames in which both are known; None of fewer than ten."""
    both = np.isfinite(ours) & np.isfinite(theirs)
    x, y = theirs[both], ours[both]
    if len(x) < 10 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return None
    slope = float(np.polyfit(x, y, 1)[0])
    return Agreement(len(x), float(np.sqrt(np.mean((y - x) ** 2))), slope, float(np.corrcoef(x, y)[0, 1]))


def compared(run: Run, data: xr.Dataset, reference: Reference) -> dict[tuple[str, str], Agreement | None]:
    """By side and joint, over the frames that the run calls measured."""
    found: dict[tuple[str, str], Agreement | None] = {}
    moments = data["moments"].transpose("time", "coordinate")
    at = data["time"].values
    for (side, joint), theirs in reference.moments.items():
        name = f"{JOINTS[joint]}_{SIDES[side]}"
        code = data["moment_source"].sel(coordinate=name).values
        ours = np.where(code == MEASURED, moments.sel(coordinate=name).values, np.nan)
        known = np.interp(at, reference.time, theirs, left=np.nan, right=np.nan)
        if side in reference.aloft and "foot_contact" in data:
            nearest = np.clip(np.searchsorted(reference.time, at - 1e-6), 0, len(reference.time) - 1)
            in_air = data["foot_contact"].sel(foot=side).values == 0
            known = np.where(reference.aloft[side][nearest] & ~in_air, np.nan, known)
        found[side, joint] = agreement(ours, known)
    return found


def _share(codes: Codes) -> str:
    return " / ".join(str(int(np.count_nonzero(codes == code))) for code in range(len(MEANINGS)))


def _mm(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"


def tables(runs: list[Run]) -> Iterator[str]:
    """Markdown, line by line."""
    yield (
        "| recording | model | exit | refused, or why not 0 | frames | right: measured / derived / prior / absent "
        "| left | markers, mean RMS, mm |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    judged = []
    for each in runs:
        data = each.data
        said = "" if each.code == 0 else each.said.replace("|", "\\|")
        if data is None:
            yield f"| `{each.trial.name}` | {each.model} | {each.code} | {said} | – | – | – | – |"
            continue
        metrics = json.loads((each.folder / "metrics.json").read_text(encoding="utf-8"))
        codes = sources(data)
        legs = [_share(codes[side]) for side in SIDES] if codes is not None else ["not declared"] * 2
        rms = metrics["markers"]["mean_rms_mm"]
        cells = [f"`{each.trial.name}`", each.model, each.code, said, data.sizes["time"], *legs, _mm(rms)]
        yield f"| {' | '.join(map(str, cells))} |"
        if codes is not None and each.trial.reference is not None:
            judged.append((each, data))
    yield ""
    yield (
        "| recording | against | joint | right: frames | RMS, N m | slope | r | its forces filtered: RMS, slope, r "
        "| left: frames | RMS, N m | slope | r | filtered |"
    )
    yield f"|{'---|' * 13}"
    for each, data in judged:
        assert each.trial.reference is not None
        reference = each.trial.reference()
        found = compared(each, data, reference)
        filtered = {}
        if each.trial.filtered is not None:
            alike = each.trial.filtered()
            seen = {key: np.interp(alike.time, reference.time, values) for key, values in reference.moments.items()}
            only = {key: np.where(np.isfinite(seen[key]), values, np.nan) for key, values in alike.moments.items()}
            filtered = compared(each, data, replace(alike, moments=only))
        for joint in JOINTS:
            cells = [a.cells if (a := found[side, joint]) else "– | – | – | –" for side in SIDES]
            cells = [
                f"{cell} | {a.short if (a := filtered.get((side, joint))) else '–'}"
                for cell, side in zip(cells, SIDES, strict=True)
            ]
            yield f"| `{each.trial.name}` | {reference.what} | {joint} | {cells[0]} | {cells[1]} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="parts of recordings' names; all where none is given")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--model", choices=("own", "fullbody"), default="own", help="own: a recording's .osim")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/validation/recordings.md")
    asked = parser.parse_args()
    chosen = [t for t in TRIALS if not asked.names or any(part in t.name for part in asked.names)]
    source = build()
    with ThreadPoolExecutor(asked.jobs) as pool:
        runs = list(pool.map(lambda trial: run(trial, asked.model, source), chosen))
    lines = list(tables(runs))
    print("\n".join(lines))
    if asked.write:
        put("validation/recordings.md", "recordings", lines)


if __name__ == "__main__":
    main()
