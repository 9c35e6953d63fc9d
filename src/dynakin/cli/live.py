"""`dynakin live`: estimate while it is measured."""

from __future__ import annotations

import gc
from datetime import datetime
from math import inf
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dynakin.cli.console import out
from dynakin.cli.options import (
    OF_A_MODEL,
    OF_THE_LABORATORY,
    Given,
    with_settings,
)
from dynakin.errors import ConfigError
from dynakin.progress import stage
from dynakin.settings.defaults import DELAY_S
from dynakin.settings.lag import LIVE_LAG_S
from dynakin.settings.settings import Settings

if TYPE_CHECKING:
    from dynakin.stream.sinks.base import Sink
    from dynakin.stream.sources.replay import Replay

_FILES = frozenset({"model", "markers", "table", "preset", "static", "parameters"})
_HOST, _PORT = "127.0.0.1", 8080


@with_settings(
    *OF_A_MODEL,
    "preset",
    "estimate",
    *OF_THE_LABORATORY,
    "contacts",
    "table",
)
def live(
    source: Annotated[
        str | None,
        typer.Option(
            help="Where samples come from: simulate:squat, replay:FILE[,speed=2][,loop], lsl:NAME, qtm:HOST, or a "
            "plug-in's KIND:..."
        ),
    ] = None,
    forces: Annotated[str | None, typer.Option(help="Plates: another source, or a force file for replay.")] = None,
    *,
    given: Given,
    parameters: Annotated[
        Path | None,
        typer.Option(help="A known person: parameters.json of an earlier run, or what dynakin identify wrote (.toml)."),
    ] = None,
    standing_wait: Annotated[
        float | None, typer.Option(help="Longest wait for somebody to stand still, s (20; replay: 3).")
    ] = None,
    delay: Annotated[float, typer.Option(help="Longest wait for packets that are late, s.")] = DELAY_S,
    lag: Annotated[
        float | None,
        typer.Option(
            help=f"By how much estimates may be late, s ({LIVE_LAG_S:g}): the frames until then help; 0: at once."
        ),
    ] = None,
    view: Annotated[bool, typer.Option("--view", help="Show it as a web page.")] = False,
    host: Annotated[str, typer.Option(help="Address of that page; 0.0.0.0: for everyone in the network.")] = _HOST,
    port: Annotated[int, typer.Option(help="Port of that page.")] = _PORT,
    record: Annotated[Path | None, typer.Option(help="Record what comes into this new folder.")] = None,
    publish: Annotated[str | None, typer.Option(help="Send estimates on: lsl[:NAME], or a plug-in's KIND:...")] = None,
    finish_folder: Annotated[
        Path | None, typer.Option("--finish", help="Turn a folder of --record into results (-o), nothing else.")
    ] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="With --finish: folder for results.")] = None,
) -> None:
    """Estimate while it is measured: from a capture system, or a recording played as if it were one.

    Exit code 1 where a recording could not be written to its end.
    """
    from dynakin.cli.summary import end, print_summary
    from dynakin.filter.build import estimator_of
    from dynakin.recordings.read import read
    from dynakin.stream.session import Live
    from dynakin.stream.sinks.recorder import Recorder, finish
    from dynakin.stream.sources.replay import Replay

    known = None
    if parameters is not None and parameters.suffix.casefold() == ".json":
        known = parameters
    elif parameters is not None:
        given["parameters"] = parameters
    for key in _FILES & given.keys():  # which a recording names, wherever it is finished
        if (file := Path(given[key])).is_file() or key == "static":
            given[key] = str(file.absolute())
    if finish_folder is not None:
        if output is None:
            raise typer.BadParameter("--finish needs -o OUT, the folder for the results")
        changed = {"--delay": delay != DELAY_S, "--host": host != _HOST, "--port": port != _PORT, "--view": view}
        named: dict[str, object] = {
            "--source": source,
            "--forces": forces,
            "--parameters": known,
            "--record": record,
        }
        named |= {"--standing-wait": standing_wait, "--lag": lag, "--publish": publish}
        changed |= {option: value is not None for option, value in named.items()}
        for option in [option for option, given_too in changed.items() if given_too]:
            raise typer.BadParameter(f"{option} changes nothing with --finish: leave it out")
        result = finish(finish_folder, output, given)
        with result.failures.stage("summary"):
            print_summary(result, output)
        end(result)
        return
    if output is not None:
        raise typer.BadParameter(f"-o {output} goes with --finish; expected --record FOLDER, and --finish afterwards")
    if source is None:
        raise typer.BadParameter(
            "--source is missing, expected simulate:squat, replay:FILE, lsl:NAME, qtm:HOST or a plug-in's KIND:..."
        )
    for option, seconds in (("--delay", delay), ("--standing-wait", standing_wait)):
        if seconds is not None and not 0.0 <= seconds < inf:
            raise typer.BadParameter(f"{option} is {seconds:g}, expected seconds, 0 or more")
    if not 0 <= port < 65536:
        raise typer.BadParameter(f"--port is {port}, expected 0 (any that is free) to 65535")
    static = given.get("static")
    settings = {"model": Settings().model} | given  # which is to stand in what is recorded
    sources = _sources(source, forces)
    if isinstance(sources[0], Replay) and view and record is None:
        _play_again(sources[0], source)
    sinks = _sinks(settings, record, publish, view, host, port)
    try:
        with stage("starting"):
            session = Live(
                estimator_of(Settings.of({}, "live", (), settings)),
                sources,
                sinks,
                lag_s=lag,
                delay_s=delay,
                standing_wait_s=standing_wait,
                static=None if static is None else read(static),
                known=None if known is None else _estimated(known),
                record=lambda: Recorder(Path(f"live-{datetime.now():%Y%m%d-%H%M%S}"), settings),
                say=lambda text: out().print(text, soft_wrap=True),
            )
    except BaseException:
        for sink in sinks:
            sink.close()
        raise
    if record is not None and known is not None:
        out().print(f"{known} is for the session alone: --finish finds constants anew, as dynakin run.", soft_wrap=True)
    gc.collect()
    gc.freeze()  # what was imported is never garbage; looking through it would cost tens of milliseconds now and then
    try:
        session.run()
    except KeyboardInterrupt:
        out().print("Stopped." if session.measured else "Stopped before anybody was measured.")
    if session.failures or not session.measured:
        raise typer.Exit(1)
    if record is not None:
        out().print(
            f"Recorded in {record}; results from it: dynakin live --finish {quote(str(record))} -o OUT", soft_wrap=True
        )


def _estimated(parameters: Path) -> dict[str, tuple[float, float]]:
    from dynakin.model.identified import read_constants

    return {
        name: (found.value, found.sd) for name, found in read_constants(parameters).constants.items() if found.estimated
    }


def _play_again(replay: Replay, address: str) -> None:
    """A recording that is watched is played again and again, so that the page stays."""
    if "loop" not in address and not replay.loop:
        replay.loop = True
        out().print("Played again and again until Ctrl-C (loop=no: once).")


def _sources(source: str, forces: str | None) -> list[Any]:
    from dynakin.recordings.read import FORCE_READERS
    from dynakin.stream.sources.plugins import SOURCES, plugin

    if forces is None:
        return [plugin(SOURCES, source)]
    if Path(forces).suffix.casefold() in FORCE_READERS and ":" not in forces[2:]:
        if not source.startswith("replay:"):
            raise ConfigError(f"--forces {forces} is a file: it goes with replay:FILE only; expected a source")
        return [plugin(SOURCES, source, forces=forces)]
    return [plugin(SOURCES, source), plugin(SOURCES, forces)]


def _sinks(
    settings: dict[str, Any], record: Path | None, publish: str | None, view: bool, host: str, port: int
) -> list[Sink]:
    from dynakin.stream.sinks.recorder import Recorder
    from dynakin.stream.sources.plugins import SINKS, plugin

    sinks: list[Sink] = []
    if publish is not None:
        sinks.append(plugin(SINKS, publish))
    if record is not None:
        sinks.append(Recorder(record, settings))
    if view:
        try:
            from dynakin.stream.viewer.sink import Viewer
        except ImportError as error:
            raise ConfigError(
                f"--view needs a package that is not here ({error}); pip install 'dynakin[live]', or make live"
            ) from None
        sinks.append(Viewer(host, port))
    return sinks
