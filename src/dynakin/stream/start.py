"""The start of a live session: markers checked against the model, the standing person measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from dynakin.elements import element
from dynakin.errors import ModelError, RecordingError
from dynakin.filter.estimator import Estimator
from dynakin.filter.ground.plate_sum import doubtful_mass
from dynakin.filter.tracker import Tracker
from dynakin.messages import Message, about, note, notes_of, warning, warnings_of
from dynakin.model.calibration.body import steady_load
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.definition import Definition
from dynakin.model.markers.recognise import foot_markers_of
from dynakin.recordings.checks import check_plates
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.landmarks import DEFAULT_PAIRS
from dynakin.recordings.orientation import axis_vector
from dynakin.recordings.plates.pressure import Surface, plate_from_wrench
from dynakin.recordings.pushes import JUDGED_N, UNLOADED_N
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.standing import standing_window
from dynakin.recordings.vertical import find_vertical
from dynakin.results.naming import listed
from dynakin.stream.fusion import Fused

_NOW_S = 0.5  # the present movement; in half of a walk's cycle each leg is once near to how it stands
_KINDS = ("length", "marker", "inertia")


def check_labels(model: Definition, recording: Recording) -> str:
    """Whether a model's markers are among those that came so far; gives a sentence on which are used.

    Raises:
        ModelError: too few of them, as of a recording; the message lists what came and what was expected.
    """
    name, expected, found, lacks = model.markers_among(recording)
    if lacks:
        raise ModelError(
            f"the stream's markers do not fit the model: {len(found)} of the {len(expected)} markers of {name} are "
            f"there, {lacks}; came: {', '.join(recording.marker_names)}; expected: {', '.join(expected)}"
        )
    return f"{name}: {len(found)} of its {len(expected)} markers are there."


def recording_of(
    fused: Sequence[Fused],
    markers: Sequence[str],
    plates: Sequence[str],
    name: str = "live",
    subject: Mapping[str, float] | None = None,
) -> Recording:
    """Samples as a recording, laboratory frame; plates as far as any of these samples has them.

    Args:
        subject: mass (kg) and height (m) as the source gives them.

    Raises:
        RecordingError: no samples, or no vertical axis to be found.
    """
    if not fused:
        raise RecordingError(f"{name}: no frames, expected some")
    time = np.array([one.sample.time_s for one in fused])
    positions = np.stack([one.positions for one in fused])
    made = Recording(name, None, time, tuple(markers), positions, subject=dict(subject or {}))
    if not plates or all(one.wrenches is None for one in fused):
        return made
    none = np.full((len(plates), 6), np.nan)
    wrenches = np.stack([none if one.wrenches is None else one.wrenches for one in fused])
    up = axis_vector(find_vertical(made, DEFAULT_PAIRS)[0])
    return made.with_plates(tuple(floor_plate(name, wrenches[:, k], up) for k, name in enumerate(plates)))


def floor_plate(name: str, wrench: np.ndarray, up: np.ndarray) -> Plate:
    """A plate of wrenches (T, 6) that lies in the floor, through the laboratory's origin: streams give no corners."""
    floor = Surface(np.zeros(3), up)
    with np.errstate(invalid="ignore"):
        return plate_from_wrench(
            name,
            wrench[:, :3],
            wrench[:, 3:],
            floor,
            corners=None,
            threshold_n=UNLOADED_N,
            zero_unloaded=False,
        )


def unknown_mass(model: Definition, subject: Mapping[str, float], plates: bool) -> bool:
    """Whether the person's mass is not given and nothing can weigh them."""
    return not model.has_mass and "mass_kg" not in subject and not plates


def stands(recording: Recording) -> bool:
    """Whether the person stands still for nearly all of a recording."""
    window = standing_window(recording)
    return window is not None and window.stop - window.start >= 0.8 * recording.n_frames


def quietest(recording: Recording, weigh: bool = True) -> tuple[Recording, Recording, Message]:
    """What to begin with where nobody stands still for long: the present moment; what the model is measured on, half a
    second or more of standing before it where there was any, else all of it; and what there is to say of it.

    Args:
        weigh: whether the mass is to come from it.
    """
    end = float(recording.time[-1])
    window = standing_window(recording)
    if window is None:
        present, weighed = recording.window(end - _NOW_S, end), ""
        if weigh:
            present, weighed = _weighed(present, recording)
        text = "the model is measured on a person who moves, whose joints and zeros of angles it shows less well"
        whole = replace(recording, subject=present.subject)
        text = f"{text}{weighed}. Stand still at the start, or give a standing trial (--static)."
        return present, whole, warning("calibration", text)
    still = recording.time[window]
    quiet = recording.window(float(still[0]), float(still[-1]))
    return (
        recording.window(end - _NOW_S, end),
        quiet,
        note("calibration", f"{still[-1] - still[0]:.1f} s of standing are taken."),
    )


def _weighed(present: Recording, whole: Recording) -> tuple[Recording, str]:
    """With the mass by the mean load of a movement that is long and steady enough (a moment alone weighs nobody), where
    nothing else gives it, and words for that, or for why the load is no weight."""
    if not whole.plates or "mass_kg" in present.subject:
        return present, ""
    try:
        mass, why = steady_load(whole, foot_loads(whole, find_ground_frame(whole), foot_markers_of(whole)))
    except RecordingError as error:
        mass, why = None, error.message
    if mass is None:
        return present, f"; the plates do not give the mass: {why}"
    words = f"; the plates' mean load, {mass:.1f} kg, is the mass where none is given"
    return replace(present, subject={**present.subject, "mass_kg": mass}), words


def begin(
    estimator: Estimator,
    standing: Recording,
    *,
    static: Recording | None = None,
    known: Mapping[str, tuple[float, float]] | None = None,
    lag_s: float = 0.0,
    rate_hz: float | None = None,
    ahead_s: float = 0.0,
) -> tuple[Tracker, list[Message], bool | None]:
    """Calibrate the model on the standing person.

    Args:
        static: another recording of the person standing: lengths and places come from it.
        known: value and standard deviation of constants from an earlier session, by their names.
        lag_s, rate_hz, ahead_s: as in `Estimator.start`.

    Returns:
        what is ready to step, what there is to say, and whether the plates can be used; None where nobody stands on
        them yet, as `check_loaded` tells later.

    Raises:
        ModelError, RecordingError: model, markers and plates do not fit.
    """
    rate_hz = rate_hz or standing.rate
    tracker = estimator.start(standing, static=static, lag_s=lag_s, rate_hz=rate_hz, ahead_s=ahead_s)
    initial = tracker.calibrated
    said = warnings_of(initial.messages)
    if known:
        tracker = estimator.start(_continued(initial, known), lag_s=lag_s, rate_hz=rate_hz, ahead_s=ahead_s)
        said.append(note("calibration", f"Lengths, marker places and masses go on from {len(known)} saved values."))
    if not standing.plates:
        return tracker, said, True
    if not loaded(standing):
        return tracker, [*said, note("plates", "Nobody stands on the plates yet; they are not checked.")], None
    told, usable = check_loaded(
        estimator, initial, static if static is not None and _most_force(static) >= JUDGED_N else standing
    )
    return tracker, [*said, *told], usable


def loaded(recording: Recording) -> bool:
    """Whether somebody stands on the plates for half of a recording."""
    push = np.sum([np.nan_to_num(np.linalg.norm(plate.force, axis=1)) for plate in recording.plates], axis=0)
    return bool(np.mean(push >= JUDGED_N) >= 0.5)


def check_loaded(estimator: Estimator, initial: CalibratedModel, recording: Recording) -> tuple[list[Message], bool]:
    """What there is to say of plates on which somebody stands, and whether they can be used.

    Raises:
        RecordingError: they cannot be meant so.
    """
    declared_kg = None if initial.feet else initial.weighed_kg
    check = check_plates(recording, initial.ground, declared_kg, initial.foot_markers)
    if check.refusal:
        raise RecordingError(f"plates: {check.refusal}")
    weighed = check.mass_kg_from_plates is not None
    said = warnings_of(check.messages)
    said += notes_of(about(check.messages, "weight")) if weighed else []
    mass, tolerance = check.mass_kg_from_plates, estimator.noise.plate_load_tolerance
    if mass is not None and tolerance is not None and abs(mass - initial.weighed_kg) > tolerance * mass:
        text = f"the plates carry {mass:.1f} kg where the person weighs {initial.weighed_kg:.1f} kg"
        return [*said, warning("weight", f"{text}; the plates are not used.")], False
    if mass is not None and initial.feet:
        doubt = doubtful_mass(initial, mass)
        said += [doubt] if doubt else []
    return said, True


def _most_force(recording: Recording) -> float:
    """The largest component that a plate reads, N; 0 without plates."""
    return max((float(np.nan_to_num(np.abs(plate.force)).max()) for plate in recording.plates), default=0.0)


def _continued(initial: CalibratedModel, known: Mapping[str, tuple[float, float]]) -> CalibratedModel:
    """The same model with constants as they were found before, as sure as they were."""
    x0, sd0 = initial.x0.copy(), initial.sd0.copy()
    places = {k: name for k, name in enumerate(initial.names) if name in known and element(name).kind in _KINDS}
    if not places:
        raise ModelError("the saved parameters are another model's: none of their names is in this model")
    beyond = []
    for k, name in places.items():
        value, sd = known[name]
        if initial.lower[k] <= value <= initial.upper[k]:
            x0[k], sd0[k] = value, sd
        else:
            beyond.append(name)
    if not beyond:
        return replace(initial, x0=x0, sd0=sd0)
    text = f"Of the saved parameters {listed(beyond)} lie beyond their bounds as measured here: measured anew."
    return replace(initial, x0=x0, sd0=sd0, messages=(*initial.messages, note("calibration", text)))
