"""Options that several commands have in common; what they mean is written once, in `dynakin.settings`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Trials = Annotated[
    list[Path] | None, typer.Argument(metavar="TRIAL...", help="Recordings, or a configuration (.toml) for each.")
]
ForceEach = Annotated[list[Path] | None, typer.Option("--forces", help="Ground forces, one a trial, in order.")]
ModelName = Annotated[str | None, typer.Option(help="Model: fullbody, squat7, sagittal7, a .toml or .osim file.")]
Force = Annotated[Path | None, typer.Option("--forces", help="Ground forces: .mot, .sto or .csv.")]
Markers = Annotated[str | None, typer.Option(help="Marker set: auto, a built-in one or a .toml file.")]
Static = Annotated[Path | None, typer.Option(help="Recording of the same person standing.")]
Mass = Annotated[float | None, typer.Option("--mass", help="Body mass, kg; else from the plates.")]
Height = Annotated[float | None, typer.Option("--height", help="Body height, m; else from the markers.")]
Sex = Annotated[str | None, typer.Option("--sex", help="male or female, for the table; else the mean of both.")]
Preset = Annotated[str | None, typer.Option(help="Noise settings: default, paper or a .toml file.")]
Smooth = Annotated[
    bool | None,
    typer.Option("--smooth/--live-like", help="Each frame from all frames (default), or as it would be live."),
]
Side = Annotated[str | None, typer.Option(help="Markers of a one-legged model: auto, right, left, both.")]
Vertical = Annotated[str | None, typer.Option(help="Laboratory axis that points up: auto, +Y, +Z, ...")]
Forward = Annotated[
    str | None,
    typer.Option(help="Facing direction: auto, an axis or three numbers (0,1,0); given, X of the results is along it."),
]
Estimated = Annotated[
    str | None, typer.Option("--estimate", help="Parameters: some of lengths,markers,soft_tissue,inertia; or none.")
]
TableName = Annotated[str | None, typer.Option("--table", help="Inertia table: dumas, deleva or a .csv file.")]
PlateFilter = Annotated[float | None, typer.Option("--plate-filter-hz", help="Low-pass filter on the plates, Hz.")]
ForceThreshold = Annotated[
    float | None, typer.Option("--force-threshold-n", help="Load below which a plate counts as empty, N.")
]
Backend = Annotated[str, typer.Option(help="Who works: processes or threads of this machine, or dask.")]
Jobs = Annotated[int | None, typer.Option(help="Workers at a time on this machine; else one a core.")]
Scheduler = Annotated[str | None, typer.Option(help="Address of the Dask cluster's scheduler, tcp://HOST:PORT.")]


def forward_direction(text: str | None) -> str | tuple[float, ...] | None:
    """`--forward 0,1,0` as numbers; a word stays a word and is checked with the configuration."""
    if text is None or "," not in text:
        return text
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(
            f"--forward is {text!r}, expected auto, an axis (+X) or three numbers (0,1,0)"
        ) from None
