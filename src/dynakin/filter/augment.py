"""From the model that was measured to the one that is filtered: soft tissue, plate errors, what is known at first."""

from __future__ import annotations

from collections.abc import Collection
from copy import copy
from dataclasses import replace

import numpy as np

from dynakin.arrays import Array, rms
from dynakin.bindings import _core
from dynakin.filter.noise import (
    BEGUN_SD,
    jerk_densities,
    joint_groups,
    plate_sd,
    soft_tissue_sd,
    soft_tissue_time_s,
)
from dynakin.filter.uncertainty.sizes import hips_unshown
from dynakin.filter.uncertainty.upright import Turned, hips_turned
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.schema import kinds_of
from dynakin.settings.model import QUANTITIES, Quantity
from dynakin.settings.noise import Noise
from dynakin.units import COMPONENTS

LEAST_SHOWN = 0.01
"""Part of a prior deviation that counts as shown at least: a state has some variance."""
CONTACT_TIME_S = 0.3
"""How long what is not known of a contact's wrench lasts: half a step."""


def extended(initial: CalibratedModel, noise: Noise, estimate: Collection[Quantity] = QUANTITIES) -> CalibratedModel:
    """The same model with the states that these noise settings ask for; places, bounds and priors follow their names.

    Displacements of soft tissue and errors of the plates start at 0 with the standard deviations declared. Of places
    that are held, what is not known of them is noise of their markers.

    Args:
        estimate: kinds of parameters to estimate; the others stay where the model has them.
    """
    spec = copy(initial.spec)  # the same measured model serves other settings, in other threads
    sd = soft_tissue_sd(noise, initial.soft_tissue_m) * ("soft_tissue" in estimate)
    markers = spec.markers
    for marker, value in zip(markers, sd, strict=True):
        marker.soft_tissue = [bool(axis and value > 0.0) for axis in marker.measured]
        if "markers" not in estimate:
            marker.estimated = [False] * 3
    spec.markers = markers
    _hold(spec, estimate)
    spec.wrench_offset = [
        bool(seen and value > 0.0) for seen, value in zip(spec.wrench_measured, plate_sd(noise), strict=True)
    ]
    spec.wrench_offset_point = initial.plate_centre
    spec.wrench_delay = noise.plate_delay_sd_s > 0.0 and not initial.feet  # jerk would take it up: `ground.fine_delay`
    spec.contacts = [*initial.feet, *initial.contacts]
    names = list(_core.Model(spec).layout.names)
    first = dict(zip(initial.names, range(len(initial.names)), strict=True))
    added = _added_sd(spec, noise, sd)

    def carried(values: Array, otherwise: float) -> Array:
        return np.array([values[first[name]] if name in first else otherwise for name in names])

    unknown = np.zeros(len(markers)) if "markers" in estimate else _place_sd(initial, first)
    return replace(
        initial,
        spec=spec,
        unmodelled_m=np.hypot(initial.unmodelled_m, unknown),
        names=tuple(names),
        x0=carried(initial.x0, 0.0),
        sd0=np.array([initial.sd0[first[name]] if name in first else added[name] for name in names]),
        lower=carried(initial.lower, -np.inf),
        upper=carried(initial.upper, np.inf),
        table=carried(initial.table, np.nan),
    )


def with_hips_shown(initial: CalibratedModel, states: Array) -> CalibratedModel:
    """The same, of whose hips' centres that much alone is estimated as a recording shows of them: the rest of the prior
    variance is ``unshown_sd``, and the centres stay as near to where standing markers have them as it is large. The
    filter's skin fades, so that each second of a squat counts as another look, though skin is displaced in each as the
    joints are bent: it found centres 16 to 25 mm too far out and believed them to 4.

    Args:
        states: (T, n) of a first run over the recording, or over as much of it as shows how it moves.
    """
    turned = hips_turned(initial, states)
    if initial.plan is None or initial.provenance.hips == "functional" or not turned:
        return initial
    legs = Turned(*np.sqrt(np.square([*turned.values()]).mean(axis=0)).tolist())
    unshown, place = hips_unshown(legs), {name: k for k, name in enumerate(initial.names)}
    prior, sd0, left = initial.prior_sd, initial.sd0.copy(), dict[str, float]()
    for segment in initial.spec.segments:
        for term in segment.lengths if segment.name in turned else ():
            k = place.get(f"length/{term.parameter}")
            if k is not None:
                part = float(np.linalg.norm(unshown * np.asarray(term.direction)))
                whole = prior[initial.names[k]]
                sd0[k], left[initial.names[k]] = whole * np.sqrt(max(1.0 - part**2, LEAST_SHOWN**2)), whole * part
    return replace(initial, sd0=sd0, unshown_sd=left)


def _place_sd(initial: CalibratedModel, first: dict[str, int]) -> Array:
    """Prior standard deviation (M,) m of each marker's place, the mean over its axes; 0 where it is no state."""
    found = np.zeros(len(initial.spec.markers))
    for k, marker in enumerate(initial.spec.markers):
        places = [first[name] for axis in "xyz" if (name := f"marker/{marker.name}/{axis}") in first]
        if places:
            found[k] = rms(initial.sd0[places])
    return found


def _hold(spec: _core.ModelSpec, estimate: Collection[Quantity]) -> None:
    if "lengths" not in estimate:
        parameters = spec.parameters
        for parameter in parameters:
            parameter.estimated = False
        spec.parameters = parameters
    if "inertia" not in estimate:
        segments = spec.segments
        for segment in segments:
            segment.inertia_estimated = [False] * 10
        spec.segments = segments


def _added_sd(spec: _core.ModelSpec, noise: Noise, soft_tissue: Array) -> dict[str, float]:
    sd = {
        f"soft_tissue/{marker.name}/{axis}": float(value)
        for marker, value in zip(spec.markers, soft_tissue, strict=True)
        for axis in "xyz"
    }
    sd |= {f"plates/{name}": float(value) for name, value in zip(COMPONENTS, plate_sd(noise), strict=True)}
    sd |= {f"contact/{name}/{axis}": 1.0 for name in spec.contacts for axis in COMPONENTS}
    return sd | {"plates/delay": noise.plate_delay_sd_s}


def variance_scales(names: Collection[str], noise: Noise) -> Array:
    """(n,) factor that these settings have put on the variance of each element of the state, by its name."""
    return np.array([1.0 if name.startswith("plates/") else noise.variance_scale for name in names])


def initial_covariance(initial: CalibratedModel, noise: Noise) -> Array:
    """P0 (n, n): the priors, and with `total_mass_use` "prior" the total mass as one piece of information on it. Speeds
    and accelerations of a model that is fixed nowhere are as unsure as `BEGUN_SD`, whatever the scale of the noise:
    most recordings of walking begin in motion.
    """
    root, sd = np.sqrt(variance_scales(initial.names, noise)), initial.sd0.copy()
    for block, begun in BEGUN_SD.items() if initial.feet else ():
        own = np.array([name.endswith(f"/{block}") for name in initial.names], dtype=bool)
        root[own], sd[own] = 1.0, np.maximum(sd[own], begun)
    scales: Array = np.outer(root, root)
    covariance: Array = np.diag(sd**2)
    if initial.joint_prior is not None:
        place = {name: k for k, name in enumerate(initial.names)}
        known = [k for k, name in enumerate(initial.joint_prior.names) if name in place]
        at = [place[initial.joint_prior.names[k]] for k in known]
        together = initial.joint_prior.covariance[np.ix_(known, known)]
        own = initial.sd0[at] / np.sqrt(np.diag(together))  # elements may be known better meanwhile
        covariance[np.ix_(at, at)] = own[:, None] * together * own
    if noise.total_mass_use == "frame":
        return np.asarray(covariance * scales)
    masses = np.array([float(name.startswith("inertia/") and name.endswith("/mass")) for name in initial.names])
    spread = covariance @ masses
    variance = float(masses @ spread)
    if variance > 0.0:
        covariance -= np.outer(spread, spread) / (variance + noise.total_mass_variance_kg2)
    return np.asarray(covariance * scales)


def continuous_noise(initial: CalibratedModel, noise: Noise, layout: _core.StateLayout) -> tuple[Array, Array]:
    """Density (n,) of the white noise that drives each element, and the rate (n,) 1/s at which it decays."""
    density, decay = np.zeros(layout.size), np.zeros(layout.size)
    kinds = kinds_of(initial.spec.segments)
    whole, groups = noise.variance_scale, joint_groups(initial)
    jerk = jerk_densities(noise, floating=bool(initial.feet))
    offset, size = layout.blocks["accelerations"]
    for k in range(offset, offset + size):
        coordinate = layout.names[k].removesuffix("/acceleration")
        group = groups.get(coordinate)
        density[k] = whole * jerk[kinds[coordinate]] * (1.0 if group is None else noise.jerk_scale.get(group, 1.0))
    offset, size = layout.blocks["lengths"]
    density[offset : offset + size] = whole * noise.length_drift_density_m2_s
    skin_s = soft_tissue_time_s(noise, initial)
    offset, size = layout.blocks["contacts"]
    decay[offset : offset + size], density[offset : offset + size] = 1.0 / CONTACT_TIME_S, whole * 2.0 / CONTACT_TIME_S
    for block, time in (("soft_tissue", skin_s), ("plates", noise.plate_time_s)):
        offset, size = layout.blocks[block]
        for k in range(offset, offset + size):
            if layout.names[k] != "plates/delay":
                decay[k] = 1.0 / time
                density[k] = 2.0 * initial.sd0[k] ** 2 / time * (whole if block == "soft_tissue" else 1.0)
    return density, decay
