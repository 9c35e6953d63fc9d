"""From the core's arrays to a labelled `Estimate`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, finite
from dynakin.bindings import _core
from dynakin.filter.augment import initial_covariance, variance_scales
from dynakin.filter.contacts import RESIDUAL, ContactLoads
from dynakin.filter.events import events_of, impossible, impossible_in_words
from dynakin.filter.ground.carried import says_carried
from dynakin.filter.labels import labels
from dynakin.filter.measurements import Measurements
from dynakin.filter.noise import limit_sd, prior_factor
from dynakin.filter.parameters import parameters_of
from dynakin.filter.sight import hidden_segments
from dynakin.filter.sources import ContactSources, with_sources
from dynakin.filter.tracker import Tracker
from dynakin.filter.uncertainty.low_pass import with_taken
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.spec import free_coordinates
from dynakin.recordings.feet.contact import ON_PLATE, UNMEASURED
from dynakin.recordings.low_passed import LowPass
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate, values_of
from dynakin.results.measures.facing import nearly_singular
from dynakin.results.measures.sources import MEASURED, plates_refused, refused_for_long, wrench_sources
from dynakin.results.records import NO_ESTIMATE_CODES, Timing
from dynakin.units import GRAVITY_M_S2

if TYPE_CHECKING:
    import xarray as xr


MANY_REFUSED = 0.2
"""Part of the frames: a chair that is sat on unannounced has 5 % refused, plates that were moved all from then on."""


def assemble(
    arrays: Mapping[str, Array],
    tracker: Tracker,
    recording: Recording,
    measured: Measurements,
    config: dict[str, Any],
    notes: Sequence[Message],
    undeclared: npt.NDArray[np.bool_] | None = None,
    systematic: Systematic | None = None,
    low_pass: LowPass | None = None,
) -> Estimate:
    """Label what `Filter.run` returned and keep what is needed to judge it.

    Args:
        arrays: as `_core.Filter.run` returns them, T frames.
        tracker: as that run left it. Constants have deviations by the declared variances, without the
            ``variance_scale`` of its noise: what is wrong with a place or a length does not average out.
        measured: as the filter took it; with the contacts' wrenches that the moments were made with.
        config: what was asked for, as plain data; "ground": why something is not measured, and by how much the plates
            were brought into step.
        notes: sentences of the plates' check.
        undeclared: (T,) frames in which something bears the person that no plate measures.
        systematic: what is added to the filter's deviations of angles, speeds, accelerations and moments.
        low_pass: what the markers went through before they were given.
    """
    initial, model, used, feet = tracker.calibrated, tracker.core_model, tracker.noise, measured.contacts
    whole = _dataset(arrays, model, initial, measured)
    ground = {"reasons": [], "plates_behind_s": 0.0} | config.get("ground", {})
    beyond, reasons = None, list(ground["reasons"])
    if feet is not None:
        weight, forces = initial.weighed_kg * GRAVITY_M_S2, arrays["foot_wrench"]
        soles = list(initial.feet.values())
        beyond = impossible(feet, forces, recording.time, weight, soles)
        beyond &= ~np.isin(arrays["tracking"], NO_ESTIMATE_CODES)
        if beyond.any():
            said = impossible_in_words(beyond, feet, forces, recording.time, weight, soles)
            reasons.append(said.text)
            notes = [*notes, said]
    if refused := _refused_in_words(whole):
        reasons.append(refused.text)
        notes = [*notes, refused]
    data = with_sources(
        whole,
        ContactSources.of(initial),
        feet,
        np.zeros(len(recording.time), dtype=bool) if undeclared is None else undeclared,
        hidden_segments(model, arrays["state"], measured.markers, recording.time, arrays["verdicts"]),
        beyond,
        says_carried(notes),
    )
    if feet is not None:
        _widen_priors(data, prior_factor(used), feet.blind)
        data = _with_total(data, feet)
        data = data.isel(foot=[name != RESIDUAL for name in feet.names])
    covariances = {"initial": initial_covariance(initial, used), "final": tracker.covariance}
    data.update({f"{when}_covariance": (("element", "element_"), P) for when, P in covariances.items()})
    noise = config.get("noise", {})
    declared = 1.0 / np.sqrt(variance_scales(initial.names, used))
    unshown = np.array([initial.unshown_sd.get(name, 0.0) for name in initial.names])
    parameters = parameters_of(
        initial,
        arrays["state"][-1],
        np.hypot(declared * arrays["state_sd"][-1], unshown),
        np.hypot(declared * np.sqrt(np.diag(covariances["initial"])), unshown),
        noise.get("length_skin_fraction", 0.0),
    )
    constants = [initial.names.index(p.name) for p in parameters if p.estimated]
    known = np.hypot(declared * data["state_sd"].values, unshown)[:, constants]
    data["state_sd"][:, constants] = known  # one deviation of a constant, wherever it is read
    config = config | {
        "mass_kg": initial.mass_kg,
        "height_m": initial.height_m,
        "side": initial.side,
        "held": dict(initial.held),
        "marker_places": "guessed" if initial.provenance.guessed_places else "named",
        "unmarked_joints": list(initial.provenance.unmarked_joints),
        "ground": {
            "vertical": initial.ground.vertical,
            "forward": initial.ground.forward.tolist(),
            "origin_m": initial.ground.origin_L.tolist(),
        }
        | ground
        | {"reasons": reasons},
    }
    events = events_of(whole, parameters, initial, limit_sd(used, used.unseen_sd))  # by what the filter itself believes
    if systematic is not None:
        left = None if feet is None else feet.noise_left()
        data = systematic.added_over_time(data, late=bool(config.get("lag_s")), noise=left)
    if low_pass is not None:
        data, said = with_taken(data, low_pass, systematic)
        notes = [*notes, said]
    estimate = Estimate(
        data=data,
        parameters=parameters,
        events=events,
        timing=_timing(arrays["step_us"], recording),
        recording=recording,
        ground=initial.ground,
        config=config,
        model_name=initial.spec.name,
        messages=[*recording.notes, *initial.messages, *notes],
    )
    estimate.messages.extend([*_without_infinities(data), *nearly_singular(estimate)])
    return estimate


def _refused_in_words(data: xr.Dataset) -> Message | None:
    """On the plates' frames that were refused; a warning where they are many."""
    estimated = ~np.isin(data["tracking"].values, NO_ESTIMATE_CODES)
    refused = plates_refused(data) & estimated
    if not refused.any():
        return None
    count, of = np.count_nonzero(refused), np.count_nonzero(estimated)
    long = refused_for_long(data) & estimated
    how = "are derived from the motion" if long.any() else "rest on the frames before and after"
    text = f"The plates contradict the motion in {count} of {of} frames and are not used there: moments {how}."
    many = count > MANY_REFUSED * of
    return warning("plates", f"{text} Check the plates' places and units.") if many else note("plates", text)


def _widen_priors(data: xr.Dataset, factor: float, blind: npt.NDArray[np.bool_]) -> None:
    """In place, by `prior_factor`: deviations of what rests on a contact that no plate measures; of the total wrench in
    frames (T,) in which no plate measures anything."""
    import xarray as xr

    unmeasured = data["foot_contact"] == UNMEASURED
    resting = (data["moment_source"] != MEASURED) & unmeasured.any("foot")
    where = {"foot_wrench_sd": unmeasured, "moments_sd": resting, "wrench_sd": xr.DataArray(blind, dims="time")}
    data.update({name: data[name].where(~these, factor * data[name]) for name, these in where.items()})


def _with_total(data: xr.Dataset, feet: ContactLoads) -> xr.Dataset:
    """With the total wrench that the contacts give where plates measure all of them, and is as sure as these, and in
    ``wrench_needed`` what the movement needs, which has all that the model does not explain in it."""
    if RESIDUAL not in feet.names:
        return data
    measured = feet.by_plates[:, None] & (wrench_sources(data) == MEASURED)
    needed, sd = values_of(data, "wrench_estimated"), values_of(data, "wrench_sd")
    given = needed - values_of(data, "wrench_remainder")
    given_sd = np.fmin(feet.plates_sd(), values_of(data, "foot_wrench_sd")[:, :-1].sum(axis=1))
    found = {
        "wrench_estimated": np.where(measured, given, needed),
        "wrench_sd": np.where(measured, given_sd, sd),
        "wrench_needed": needed,
    }
    return data.assign({name: (("time", "component"), values) for name, values in found.items()})


def _without_infinities(data: xr.Dataset) -> list[Message]:
    """Takes infinite numbers for what they are, not known; a sentence on each variable that has any."""
    said = []
    for name, variable in data.data_vars.items():
        count = int(np.isinf(variable.values).sum()) if variable.dtype.kind == "f" else 0
        if count:
            variable.values = finite(variable.values)
            said.append(warning("numbers", f"{name}: {count} numbers are infinite and left out."))
    return said


def _dataset(
    arrays: Mapping[str, Array],
    model: _core.Model,
    initial: CalibratedModel,
    measured: Measurements,
) -> xr.Dataset:
    import xarray as xr  # it is loaded while the core works

    spec, feet = initial.spec, measured.contacts
    axes = np.array(spec.markers[0].measured)
    modelled = np.array(spec.wrench_measured)
    data: dict[str, Any] = {}
    for block, values in _coordinate_blocks(arrays, model).items():
        data[block] = (("time", "coordinate"), values)
    if initial.coupled is not None:
        names = [coordinate.name for coordinate in spec.coordinates]
        values = initial.coupled.values(names, data["coordinates"][1])
        data["coupled_coordinates"] = (("time", "coupled_coordinate"), values)
    data["moments"] = (("time", "coordinate"), arrays["moments"])
    data["moments_sd"] = (("time", "coordinate"), arrays["moments_sd"])
    missing = np.count_nonzero(np.isnan(measured.markers), axis=2, keepdims=True) > 0
    for name, values in (
        ("measured", np.where(missing, np.nan, measured.markers)),
        ("estimated", arrays["markers_estimated"]),
        ("predicted", arrays["markers_predicted"]),
    ):
        data[f"markers_{name}"] = (("time", "marker", "axis"), np.where(axes, values, np.nan))
    for name, values in (
        ("measured", measured.wrench),
        ("estimated", arrays["wrench_estimated"]),
        ("predicted", arrays["wrench_predicted"]),
    ):
        data[f"wrench_{name}"] = (("time", "component"), np.where(modelled, values, np.nan))
    data["markers_sd"] = (("time", "marker", "axis"), np.where(axes, arrays["markers_sd"], np.nan))
    data["wrench_sd"] = (("time", "component"), np.where(modelled, arrays["wrench_sd"], np.nan))
    data["state"] = (("time", "element"), arrays["state"])
    data["state_sd"] = (("time", "element"), arrays["state_sd"])
    for name in ("nis", "n_rows", "log_likelihood", "constrained", "constraints_met", "tracking", "step_us"):
        data[name] = ("time", arrays[name])
    held = np.zeros((len(measured.time), len(spec.coordinates)), dtype=bool)
    held[:, free_coordinates(spec)] = arrays["at_limit"]
    data["at_limit"] = (("time", "coordinate"), held)
    data |= _sensors(arrays, np.asarray(np.isnan(measured.wrench).all(axis=1)))
    if initial.feet or any(any(marker.soft_tissue) for marker in spec.markers):
        data["soft_tissue_amplitude"] = ("marker", initial.soft_tissue_m, {"units": "m"})
    data |= _body(arrays, model, axes, modelled, feet)
    if feet is not None:
        data |= _feet(arrays, feet)
    return xr.Dataset(data, coords=labels(model, initial, measured.time, feet))


def _sensors(arrays: Mapping[str, Array], unmeasured: npt.NDArray[np.bool_]) -> dict[str, Any]:
    """What each sensor said against what was expected of it; the core numbers 3 channels a marker, then the plates'.

    Args:
        unmeasured: (T,) frames in which priors stand for what plates do not measure: no word of a sensor.
    """
    verdicts, ratio = arrays["verdicts"].copy(), arrays["test_ratio"].copy()
    verdicts[unmeasured, -1], ratio[unmeasured, -1] = 0, np.nan
    data: dict[str, Any] = {"verdict": (("time", "sensor"), verdicts)}
    data["test_ratio"] = (("time", "sensor"), ratio)
    for name in ("innovation", "innovation_sd"):
        markers = arrays[name][:, :-6]
        data[f"markers_{name}"] = (("time", "marker", "axis"), markers.reshape(len(markers), -1, 3))
        data[f"wrench_{name}"] = (("time", "component"), np.where(unmeasured[:, None], np.nan, arrays[name][:, -6:]))
    return data


def _feet(arrays: Mapping[str, Array], feet: ContactLoads) -> dict[str, Any]:
    per_foot = ("time", "foot", "component")
    measured = np.where((feet.contact == ON_PLATE)[..., None], feet.wrench, np.nan)
    others = [k for k, name in enumerate(feet.names) if name == RESIDUAL]
    no_feet = arrays["remainder"] + np.asarray(arrays["foot_wrench"])[:, others].sum(axis=1)  # a seat's, say
    return {
        "foot_contact": (("time", "foot"), feet.contact),
        "foot_wrench_measured": (per_foot, measured),
        "foot_wrench": (per_foot, arrays["foot_wrench"]),
        "foot_wrench_sd": (per_foot, arrays["foot_wrench_sd"]),
        "foot_adjustment": (per_foot, np.where(np.isfinite(measured), arrays["foot_adjustment"], np.nan)),
        "wrench_remainder": (("time", "component"), no_feet),
        "moment_source": (("time", "coordinate"), arrays["moment_source"]),
    }


def _coordinate_blocks(arrays: Mapping[str, Array], model: _core.Model) -> dict[str, Array]:
    """Coordinates, speeds, accelerations and their deviations of all coordinates; locked ones stand still, for sure."""
    spec = model.spec
    free = free_coordinates(spec)
    frames = len(arrays["state"])
    blocks: dict[str, Array] = {}
    for name in ("coordinates", "speeds", "accelerations"):
        offset, size = model.layout.blocks[name]
        value, sd = (np.zeros((frames, len(spec.coordinates))) for _ in range(2))
        if name == "coordinates":
            value[:] = [coordinate.value for coordinate in spec.coordinates]
        value[:, free] = arrays["state"][:, offset : offset + size]
        sd[:, free] = arrays["state_sd"][:, offset : offset + size]
        blocks[name], blocks[f"{name}_sd"] = value, sd
    return blocks


def _body(
    arrays: Mapping[str, Array], model: _core.Model, axes: Array, modelled: Array, feet: ContactLoads | None
) -> dict[str, Any]:
    """Joint centres, centre of mass and loads of the joints; out of a model's plane they are NaN."""
    on_feet = () if feet is None else (list(feet.segments), np.ascontiguousarray(arrays["foot_wrench"]))
    found = _core.whole_body(model, np.ascontiguousarray(arrays["state"]), *on_feet)
    return {
        "joint_centres": (("time", "joint", "axis"), found["joint_centres"], {"units": "m"}),
        "joint_orientations": (("time", "joint", "axis", "axis_"), found["orientations"], {"units": "1"}),
        "joint_loads": (("time", "joint", "component"), np.where(modelled, found["joint_loads"], np.nan)),
        "mass_centre": (("time", "axis"), np.where(axes, found["mass_centre"], np.nan)),
        "mass_centre_velocity": (("time", "axis"), np.where(axes, found["mass_centre_velocity"], np.nan)),
    }


def _timing(step_us: Array, recording: Recording) -> Timing:
    total = float(step_us.sum()) * 1e-6
    duration = float(recording.time[-1] - recording.time[0])
    return Timing(
        frames=len(step_us),
        median_us=float(np.median(step_us)),
        p99_us=float(np.percentile(step_us, 99)),
        realtime_factor=duration / total if total > 0.0 else float("nan"),
    )
