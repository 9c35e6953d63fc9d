"""Estimates of what no plate measured, against what was known of it: errors, and whether the deviations cover them.

One contact of one trial is judged on its own, over the frames in which it bears load, by what the program calls each
value (`dynakin.results.measures.sources.MEANINGS`; `ALOFT` where it says that nothing touches the contact). Works for
any trial with a wrench of each contact: withheld plates, or a simulation's truth.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dynakin.recordings.feet.contact import NO_CONTACT
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Plate
from dynakin.results.measures.feet import foot_sources
from dynakin.results.measures.pressure import centre_of_pressure
from dynakin.results.measures.sources import ABSENT, MEANINGS, MEASURED, moment_sources
from dynakin.simulation.truth import Truth
from dynakin.units import GRAVITY_M_S2

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LOADED_N = 20.0
"""Vertical force from which a contact bears load."""
PRESSED_N = 100.0
"""The same for its centre of pressure."""
EMPTY_N = 5.0
"""Vertical force up to which it bears none."""
NORMAL_95 = 1.96
ALOFT = "aloft"
"""What the program calls a contact of which it says that nothing touches it: its wrench is then zero, for sure."""
FORCES = ("vertical", "along", "across")
PRESSURES = ("pressure_along", "pressure_across")
IN_AIR = "vertical_in_air"
JOINTS = {"hip": "hip_flexion", "knee": "knee_angle", "ankle": "ankle_angle"}
"""Flexion moments that are judged, and the stems of their coordinates."""
QUANTITIES = (*FORCES, *PRESSURES, *JOINTS, IN_AIR)


@dataclass(frozen=True, eq=False)
class Load:
    """What truly pressed on one contact.

    Attributes:
        wrench: (T, 6) N and N m, ground on person, laboratory axes, about the laboratory's origin; NaN where it is not
            known.
        surface_L: (3,) or (T, 3) m, a point of the level surface on which its centre of pressure is judged; None: it is
            not.
    """

    wrench: Array
    surface_L: Array | None


@dataclass(frozen=True, eq=False)
class Reference:
    """What is known of a trial.

    Attributes:
        loads: by contact, named as in an estimate ("right", "left").
        moments: by coordinate, (T,) N m, NaN where they are not known.
        judged: (T,) frames.
    """

    loads: Mapping[str, Load]
    moments: Mapping[str, Array]
    judged: Flags
    mass_kg: float


@dataclass(frozen=True, eq=False)
class Found:
    """What an estimate says, as far as it is judged: its arrays in the ground frame (`dynakin.Estimate.data`)."""

    data: xr.Dataset
    ground: GroundFrame


@dataclass(frozen=True)
class Score:
    """One quantity of one contact where the program calls it ``called``.

    Attributes:
        frames, of: frames in which it is called so, of those that are judged.
        rms, bias: of the error: N, m, N m; None where nothing is given. given: frames in which it is.
        inside: part of these within 1.96 standard deviations. sd: RMS of the deviation. None: without deviations.
    """

    contact: str
    quantity: str
    called: str
    frames: int
    of: int
    given: int
    rms: float | None
    bias: float | None
    inside: float | None
    sd: float | None

    @property
    def sd_over_error(self) -> float | None:
        """RMS of the deviation over that of the error: 1 is right, 2 means intervals twice too wide."""
        return None if self.sd is None or not self.rms else self.sd / self.rms


def of_plates(plates: Mapping[str, list[Plate]]) -> dict[str, Load]:
    """Loads of contacts that stand on plates of their own, by contact; measured where all its plates are."""
    loads = {}
    for contact, own in plates.items():
        wrench = np.sum([np.hstack([plate.force, plate.moment]) for plate in own], axis=0)
        loads[contact] = Load(wrench, _surface(own))
    return loads


def _surface(plates: list[Plate]) -> Array:
    """Middle of where the plates were pressed (3,) m."""
    points = [plate.cop[np.linalg.norm(np.nan_to_num(plate.force), axis=1) > PRESSED_N] for plate in plates]
    return np.asarray(np.nanmedian(np.concatenate(points), axis=0))


def of_truth(truth: Truth, judged: Flags) -> Reference:
    """All contacts of a simulated trial. Its feet are called as an estimate calls them, "right" and "left"."""
    data, origin = truth.data, truth.origin_L
    loads = {}
    for name in data["contact"].values:
        about_ground = data["contact_wrench"].sel(contact=name).transpose("time", "component").values
        force = about_ground[:, :3]
        wrench = np.hstack([force, about_ground[:, 3:] + np.cross(origin, force)])
        surface = None
        if str(name).endswith(" foot"):  # on steps, floors differ
            surface = origin if "contact_point" not in data else data["contact_point"].sel(contact=name).values + origin
        loads[str(name).removesuffix(" foot")] = Load(wrench, surface)
    moments = data["moments"].transpose("time", "coordinate").values
    names = [str(name) for name in data["coordinate"].values]
    return Reference(loads, {name: moments[:, k] for k, name in enumerate(names)}, judged, truth.subject.mass_kg)


def measured_moments(found: Found) -> dict[str, Array]:
    """By coordinate, those that an estimate calls measured: the reference where there is no truth."""
    codes = moment_sources(found.data)
    moments = found.data["moments"].transpose("time", "coordinate").values
    return {
        str(name): np.where(codes[:, k] == MEASURED, moments[:, k], np.nan)
        for k, name in enumerate(found.data["coordinate"].values)
    }


def judge(found: Found, reference: Reference) -> list[Score]:
    """Every contact that both have."""
    if "foot" not in found.data.coords:
        return []
    names = [str(name) for name in found.data["foot"].values]
    return [
        s for name, load in reference.loads.items() if name in names for s in _contact(found, reference, name, load)
    ]


def judge_moments(found: Found, reference: Reference) -> list[Score]:
    """Every coordinate whose true moment is known, in all judged frames; ``contact`` is the coordinate's name."""
    data, codes = found.data, moment_sources(found.data)
    scores: list[Score] = []
    for k, name in enumerate(str(name) for name in data["coordinate"].values):
        if name in reference.moments:
            own, true = data.sel(coordinate=name), reference.moments[name]
            called = np.array(MEANINGS)[codes[:, k]]
            frames = reference.judged & np.isfinite(true)
            scores += _scores(name, "moment", own["moments"].values - true, own["moments_sd"].values, called, frames)
    return scores


def _contact(found: Found, reference: Reference, name: str, load: Load) -> Iterator[Score]:
    data, ground = found.data.sel(foot=name), found.ground
    true = ground.wrench_to_ground(load.wrench)
    wrench, sd = (data[key].transpose("time", "component").values for key in ("foot_wrench", "foot_wrench_sd"))
    touches = data["foot_contact"].values
    codes = _names(foot_sources(found.data)[:, list(found.data["foot"].values).index(name)], touches)
    push = true[:, 1]
    with np.errstate(invalid="ignore"):
        loaded, pressed, empty = (
            reference.judged & flags for flags in (push > LOADED_N, push > PRESSED_N, np.abs(push) < EMPTY_N)
        )
    along, across = _axes(ground)
    for quantity, k in zip(FORCES, (1, along, across), strict=True):
        yield from _scores(name, quantity, wrench[:, k] - true[:, k], sd[:, k], codes, loaded)
    yield from _scores(name, IN_AIR, wrench[:, 1] - push, sd[:, 1], codes, empty)
    if load.surface_L is not None:
        off = _pressure(wrench, ground, load.surface_L) - _pressure(true, ground, load.surface_L)
        for quantity, k in zip(PRESSURES, (along, across), strict=True):
            yield from _scores(name, quantity, off[:, k], None, codes, pressed)
    sources = moment_sources(found.data)
    for joint, stem in JOINTS.items():
        coordinate = f"{stem}_{name[:1]}"
        if coordinate not in reference.moments or coordinate not in found.data["coordinate"].values:
            continue
        at = list(found.data["coordinate"].values).index(coordinate)
        own = found.data.sel(coordinate=coordinate)
        known = loaded & np.isfinite(reference.moments[coordinate])
        error = own["moments"].values - reference.moments[coordinate]
        yield from _scores(name, joint, error, own["moments_sd"].values, _names(sources[:, at], touches), known)


def _pressure(wrench: Array, ground: GroundFrame, surface_L: Array) -> Array:
    """Centre of pressure (T, 3) m on level surfaces through points, at any height there."""
    up = np.zeros((len(wrench), 3))
    up[:, 1] = ground.points_to_ground(surface_L)[..., 1]
    about = np.hstack([wrench[:, :3], wrench[:, 3:] - np.cross(up, wrench[:, :3])])
    return centre_of_pressure(np.where(np.isfinite(up[:, [1]]), about, np.nan), 0.0)[0]


def _axes(ground: GroundFrame) -> tuple[int, int]:
    """Numbers of the ground's horizontal axes that are nearest to the way the person faces, and across it."""
    ahead = np.abs(ground.vectors_to_ground(ground.forward))
    return (0, 2) if ahead[0] >= ahead[2] else (2, 0)


def _names(codes: NDArray[np.integer], touches: NDArray[np.integer]) -> NDArray[np.str_]:
    """(T,) what the program calls a value; what is known only because it sees no contact is no measurement."""
    called = np.array(MEANINGS)[codes]
    return np.where((touches == NO_CONTACT) & (codes != ABSENT), ALOFT, called)


def _scores(
    contact: str, quantity: str, error: Array, sd: Array | None, called: NDArray[np.str_], frames: Flags
) -> Iterator[Score]:
    of = int(frames.sum())
    for meaning in (*MEANINGS, ALOFT):
        here = frames & (called == meaning)
        if not here.any():
            continue
        given = here & np.isfinite(error)
        rms = bias = inside = spread = None
        if given.any():
            e = error[given]
            rms, bias = _rms(e), float(e.mean())
            if sd is not None and np.isfinite(sd[given]).all():
                s = sd[given]
                inside = float(np.mean(np.abs(e) <= NORMAL_95 * s))
                spread = _rms(s)
        yield Score(contact, quantity, meaning, int(here.sum()), of, int(given.sum()), rms, bias, inside, spread)


def pool(scores: Sequence[Score], called: str) -> Score | None:
    """One score of all that are called so, of one quantity over contacts and trials: every frame counts the same.

    Args:
        scores: each with its fellows that are called otherwise, so that the frames add up.
    """
    own = [score for score in scores if score.called == called]
    if not own:
        return None
    of = sum(score.frames for score in scores)
    given = sum(score.given for score in own)
    first = replace(own[0], frames=sum(score.frames for score in own), of=of, given=given)
    known = [score for score in own if score.given]
    if not known:
        return first
    weights = np.array([score.given for score in known], dtype=float)

    def mean(values: Sequence[float | None]) -> float | None:
        return None if any(v is None for v in values) else float(np.average(np.array(values, float), weights=weights))

    inside, bias = mean([score.inside for score in known]), mean([score.bias for score in known])
    rms, sd = (
        None if square is None else float(np.sqrt(square))
        for square in (mean([_square(score.rms) for score in known]), mean([_square(score.sd) for score in known]))
    )
    return replace(first, rms=rms, bias=bias, inside=inside, sd=sd)


def _square(value: float | None) -> float | None:
    return None if value is None else value**2


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def within(time: Array, spans: tuple[tuple[float, float], ...]) -> Flags:
    """(T,) frames within spans of seconds."""
    return np.asarray(np.any([(time >= start) & (time <= end) for start, end in spans], axis=0))


HEAD = "vertical, % of weight | along, N | across, N | pressure along, across, mm | hip | knee | ankle, N m"
"""Of what `cells` gives."""
WORDS = (*MEANINGS, ALOFT)


def cells(own: Mapping[str, Score], mass_kg: float) -> Iterator[str]:
    """Scores by quantity of one contact and one word as cells of a table: share of the frames (force, or force / hip /
    knee / ankle), then for each quantity RMS error (percent of it within 1.96 deviations; deviation over error)."""
    shares = [_share(own.get(quantity)) for quantity in ("vertical", *JOINTS) if quantity in own] or ["0"]
    yield shares[0] if len(set(shares)) == 1 else " / ".join(shares)
    yield _cell(own.get("vertical"), 100.0 / (mass_kg * GRAVITY_M_S2), 1)
    yield _cell(own.get("along"), 1.0, 0)
    yield _cell(own.get("across"), 1.0, 0)
    yield ", ".join(_cell(own.get(quantity), 1000.0, 0) for quantity in PRESSURES)
    for joint in JOINTS:
        yield _cell(own.get(joint), 1.0, 1)


def _share(score: Score | None) -> str:
    return "0" if score is None or not score.of else f"{100.0 * score.frames / score.of:.0f}"


def _cell(score: Score | None, factor: float, digits: int) -> str:
    if score is None or score.rms is None:
        return "–"
    text = f"{score.rms * factor:.{digits}f}"
    if score.inside is None:
        return text
    ratio = "–" if score.sd_over_error is None else f"{score.sd_over_error:.2g}"
    return f"{text} ({100.0 * score.inside:.0f}; {ratio})"
