"""Messages: what stands in files and on consoles, and what is known of them when a file is read again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import xarray as xr

from dynakin.messages import (
    TOPICS,
    Message,
    Topic,
    about,
    as_attributes,
    from_attributes,
    note,
    notes_of,
    warning,
    warnings_of,
)
from dynakin.pipeline.result import Result
from dynakin.results.files.netcdf import full_dataset, write_netcdf
from support.estimates.synthetic import make_estimate


def test_a_message_opens_with_its_level_where_it_is_shown_and_has_its_words_without() -> None:
    assert str(warning("mass", "it is assumed.")) == "Warning: it is assumed."
    assert str(note("mass", "Mass 70 kg: given.")) == "Mass 70 kg: given."
    assert str(Message("results", "failure", "figures: no space.")) == "Failed: figures: no space."
    assert str(warning("plates", "one drifts.").of("walk")) == "Warning: walk: one drifts."


def test_whoever_asks_gets_messages_by_topic_and_level() -> None:
    said = [warning("mass", "a"), note("mass", "b"), note("plates", "Warning: c"), Message("results", "failure", "d")]
    assert about(said, "mass") == said[:2] and about(said, "mass", "results") == [said[0], said[1], said[3]]
    assert warnings_of(said) == said[:1] and notes_of(said) == said[1:3]


@pytest.mark.parametrize("topic", TOPICS)
def test_topics_survive_saving_and_loading(topic: Topic, tmp_path: Path) -> None:
    said = [note(topic, "A note."), warning(topic, "one: two."), Message(topic, "failure", "three\u2028four.")]
    assert from_attributes(as_attributes(said)) == said


def test_an_estimate_that_is_written_keeps_its_messages(tmp_path: Path) -> None:
    said = [
        warning("weight", "the plates carry less."),
        note("routine", "Time 0 is\nframe 1."),
        note("in step", "Done."),
    ]
    write_netcdf(replace(make_estimate(1.0), messages=said), tmp_path / "estimate.nc")
    with xr.open_dataset(tmp_path / "estimate.nc") as data:
        assert data.attrs["messages"].startswith("Warning: the plates carry less.\n")
        read = from_attributes(data.attrs)
    assert read == [said[0], replace(said[1], text="Time 0 is frame 1."), said[2]]


def test_no_messages_are_none_and_files_that_had_no_topics_keep_the_levels() -> None:
    assert from_attributes(full_dataset(replace(make_estimate(1.0), messages=[])).attrs) == []
    old = {"messages": "Warning: gaps were filled.\nMass 70 kg: given."}
    assert from_attributes(old) == [warning("recording", "gaps were filled."), note("recording", "Mass 70 kg: given.")]


def test_metrics_are_those_of_the_file_with_messages_and_failures(tmp_path: Path) -> None:
    import json

    result = Result(replace(make_estimate(1.0), messages=[warning("plates", "one drifts.")]))
    with result.failures.stage("a figure"):
        raise MemoryError("too large")
    written = json.loads((result.save(tmp_path / "out", check=False) / "metrics.json").read_text())
    metrics = result.metrics()
    assert (
        metrics["messages"]
        == written["messages"]
        == ["Warning: one drifts.", "Failed: a figure: MemoryError: too large."]
    )
    assert metrics["failures"] == written["failures"] == ["a figure"]
    assert written.keys() - metrics.keys() <= {"versions"}
