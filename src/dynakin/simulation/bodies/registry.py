"""Which simulated persons there are by name, and what one of a user's own must fulfil."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dynakin.errors import ConfigError
from dynakin.settings.strict import nearest
from dynakin.simulation.bodies import whole_body
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.planar import SAGITTAL7, SQUAT7
from dynakin.simulation.bodies.subject import SimulatedSubject, Spread, draw_subject
from dynakin.simulation.streams import Streams

BODIES: dict[str, Callable[[SimulatedSubject, np.random.Generator], SimulatedBody]] = {
    "sagittal7": SAGITTAL7.build_body,
    "squat7": SQUAT7.build_body,
    "fullbody": whole_body.build_body,
}
"""Bodies by the name of the model whose coordinates they have: built of a subject, markers put on with the
generator."""


def choose_body(
    model: str | SimulatedBody,
    streams: Streams,
    mass_kg: float,
    height_m: float,
    sex: str | None,
    spread: Spread,
    markers: str | None = None,
) -> SimulatedBody:
    """The body of that name, drawn around the table, with the markers of that set (None: its own); one of a user's
    own is checked and taken as it is.

    Raises:
        ConfigError: no such body, a marker set for another than fullbody, a subject that cannot be, or a tree that does
            not hang together.
        ModelError: no such marker set.
    """
    if markers is not None and model != "fullbody":
        raise ConfigError(
            f"simulation: markers is {markers!r} for {model if isinstance(model, str) else model.name!r}, expected "
            "a marker set for fullbody only, nothing for the others, which have one set each"
        )
    if isinstance(model, SimulatedBody):
        _check(model)
        return model
    if model not in BODIES:
        hint = nearest(str(model), BODIES)
        raise ConfigError(f"simulation: model is {str(model)!r}{hint}, expected {' or '.join(BODIES)}")
    subject = draw_subject(streams["subject"], mass_kg, height_m, sex, spread)
    if markers is not None:
        return whole_body.build_body(subject, streams["sites"], markers)
    return BODIES[model](subject, streams["sites"])


def _check(body: SimulatedBody) -> None:
    where = f"simulated body {body.name!r}"
    known: list[str] = []
    for segment in body.tree:
        if segment.parent is not None and segment.parent not in known:
            raise ConfigError(
                f"{where}: the parent of {segment.name!r} is {segment.parent!r}, expected a segment before it: "
                f"{', '.join(known) or 'none yet'}"
            )
        if not segment.mass > 0.0:
            raise ConfigError(f"{where}: the mass of {segment.name!r} is {segment.mass:g} kg, expected more than 0")
        known.append(segment.name)
    for what, name, segment_name in (
        *(("marker", site.name, site.segment) for site in body.sites),
        *(("contact", foot.name, foot.segment) for foot in body.feet if foot.segment is not None),
    ):
        if segment_name not in known:
            raise ConfigError(f"{where}: {what} {name!r} is on {segment_name!r}, expected one of {', '.join(known)}")
    if not 1 <= len(body.feet) <= 2:
        raise ConfigError(f"{where}: {len(body.feet)} feet, expected one contact or the right and the left foot")
