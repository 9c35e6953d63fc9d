"""The table that `run`, `demo` and `live --finish` end with, and their exit code."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer
from rich.console import Console
from rich.table import Table

from dynakin.cli.console import out, print_error, table
from dynakin.filter.ground.closure import STATED
from dynakin.messages import Message, about, notes_of
from dynakin.pipeline.result import Result
from dynakin.report.findings.finding import Insight
from dynakin.report.insights import in_short, insights
from dynakin.results.estimate import Estimate
from dynakin.results.measures.bounds import counts_in_words
from dynakin.results.measures.sources import MEANINGS, UNKNOWN
from dynakin.results.measures.tracking import why_lost
from dynakin.results.naming import listed
from dynakin.settings.lag import in_words


def print_summary(result: Result, folder: Path, said: Sequence[Message] = ()) -> None:
    """Which moments there are, the figures, the verdict with all that is warned of, and where the files lie.

    Args:
        said: notes that stand above already.
    """
    console, estimate, metrics = out(), result.estimate, result.metrics()
    moments = metrics["moments"] or UNKNOWN
    _print_moments(console, moments)
    for name, found in (metrics["contacts"] or {}).items():
        console.print(f"  {_contact_in_words(name, found)}", style="dim")
    console.print(_figures(estimate, metrics))
    for message in notes_of(about(estimate.messages, "smoothing", "in step", "zero", "carried")):
        if message not in said:
            console.print(str(message))
    _print_verdict(console, insights(estimate, metrics), moments["reasons"])
    console.print(f"Results  {folder}", soft_wrap=True)
    if (folder / "report.html").exists():
        console.print(f"Report   {folder / 'report.html'}", soft_wrap=True)


NOTED = ("Uncertainty",)
"""Those whose notes are said in the verdict too; where they have nothing against a run they are on the page alone."""


def _print_verdict(console: Console, found: list[Insight], reasons: Sequence[str]) -> None:
    """Whether anything speaks against using the run; then each warning, and what to do about it.

    Args:
        reasons: sentences that stand above, with the moments.
    """
    said = [in_short(found), *(each.text for each in found if each.title in NOTED and each.level == "note")]
    warned = [each for each in found if each.level == "warning"]
    console.print(f"Verdict: {' '.join(said)}", style="yellow" if warned else "green")
    for each in warned:
        text, above = each.text, [reason for reason in reasons if reason in each.text]
        for reason in above:
            text = text.replace(reason, "").strip()
        if above and not text:
            text = _in_a_clause(above)
        if text:
            console.print(f"  {each.title}: {text}", style="yellow")
        if each.advice:
            console.print(f"  {each.title}, what to do: {each.advice}", style="dim")
    console.print()


def _in_a_clause(reasons: Sequence[str]) -> str:
    """The first of some sentences that stand above, without what follows a colon or a bracket, and how many more there
    are."""
    rest = re.compile(r": | \(|\.$").search(reasons[0], len("Plate 1, plate 2: "))
    more = f", and {len(reasons) - 1} more" if len(reasons) > 1 else ""
    return f"{reasons[0][: rest.start() if rest else None]}{more} (above)."


def end(result: Result) -> None:
    """Say what failed, and that a trial was lost.

    Raises:
        typer.Exit: there was something to say; code 1.
    """
    wrong = [*map(str, result.failures.messages()), *filter(None, [why_lost(result.estimate)])]
    for message in wrong:
        print_error(message)
    if wrong:
        raise typer.Exit(1)


def _print_moments(console: Console, moments: dict[str, Any]) -> None:
    """First of all which moments there are, and why not all."""
    whole = bool(moments["legs"]) and all(leg["measured"] == moments["frames"] for leg in moments["legs"].values())
    console.print(moments["verdict"], style="" if whole else "yellow")
    for reason in moments["reasons"]:
        console.print(f"  {reason}", style="dim")


def _contact_in_words(name: str, found: dict[str, Any]) -> str:
    """What came of a declared contact, and what that rests on."""
    if not found["frames"]:
        return (
            f"The {name}, declared, bears nothing in this recording that shows. Less than {100.0 * STATED:.0f} % of "
            "the weight all the time would not show (of a hand, deviations of arms and L5/S1 hold that), nor would "
            "what it bears on the plate of a foot: give it a plate of its own."
        )
    how = listed([f"{what} in {found[what]}" for what in MEANINGS if found[what]])
    size = ""
    if found["largest_n"] is not None:
        size = f", up to {found['largest_n']:.0f} N (standard deviation {found['sd_n']['fy']:.0f} N upwards)"
    return f"The {name}, declared, bears in {found['frames']} frames ({how}){size}; all of it on its one segment."


def _figures(estimate: Estimate, metrics: dict[str, Any]) -> Table:
    window = metrics["window"]
    rows = table(
        "figure",
        "value",
        "",
        numbers=(1,),
        title=f"{estimate.recording.name}, {estimate.model_name}: {window['start_s']:g} to {window['end_s']:g} s",
    )
    rows.add_row("each frame is estimated", in_words(estimate.lag_s), "")
    refused = sorted({event.subject for event in estimate.events if event.kind == "gated"})
    markers, wrench, events = (metrics[block] or {} for block in ("markers", "wrench", "events"))
    rms = {name: value for name, value in markers.get("rms_mm", {}).items() if value is not None}
    if rms:
        worst = max(rms, key=lambda name: rms[name])
        rows.add_row(
            "markers, mean RMS",
            f"{markers['mean_rms_mm']:.2f} mm",
            f"{len(rms)} markers; fit, not accuracy",
        )
        rows.add_row(
            "worst marker, RMS", f"{rms[worst]:.2f} mm", worst + (", refused for a time" if worst in refused else "")
        )
    for name, value in wrench.get("rms", {}).items():
        unit = "N" if name.startswith("f") else "N m"
        share = wrench["nrms_percent"][name]
        rows.add_row(
            f"wrench {name}, RMS", f"{value:.2f} {unit}", "" if share is None else f"{share:.1f} % of measured"
        )
    if metrics["adaptation"] and not estimate.smoothed:
        after = metrics["adaptation"]["after_s"]
        rows.add_row("settled after", "-" if after is None else f"{after:.1f} s", "")
    stuck = [p for p in estimate.parameters if p.at_bound]
    free = sum(p.estimated and p.lower is not None for p in estimate.parameters)
    by_kind = counts_in_words(metrics["bounds"]["by_kind"]) if stuck and metrics["bounds"] else ""
    rows.add_row("parameters on a bound", f"{len(stuck)} of {free}", by_kind)
    moved = (metrics["soft_tissue"] or {}).get("markers", {})
    moved = {name: m for name, m in moved.items() if m["max_mm"] is not None}
    if moved:
        most = max(moved, key=lambda name: moved[name]["max_mm"])
        expected = moved[most]["expected_mm"]
        size = "" if expected is None else f" (usual {expected:.0f} mm)"
        rows.add_row("largest move on a segment", f"{moved[most]['max_mm']:.0f} mm", f"{most}{size}")
    gaps = events.get("missing_frames")
    if gaps is not None:
        rows.add_row("markers with gaps", str(len(gaps)), ", ".join(gaps))
    if refused:
        rows.add_row("refused for a time", str(len(refused)), ", ".join(refused))
    resets = [event for event in estimate.events if event.kind == "reset"]
    if resets:
        rows.add_row("motion lost or found again", str(len(resets)), f"first at {resets[0].time_s:.2f} s")
    timing = estimate.timing
    rows.add_row(
        "time of a step, median",
        f"{timing.median_us:.0f} µs",
        f"{timing.realtime_factor:.1f} times as fast as the movement",
    )
    return rows
