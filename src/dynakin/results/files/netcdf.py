"""``estimate.nc``: all of an estimate as one labelled netCDF file; ``xarray.open_dataset`` reads it back."""

from __future__ import annotations

import json
from collections.abc import Hashable
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
import xarray as xr

from dynakin.arrays import finite
from dynakin.files import with_nulls
from dynakin.messages import as_attributes
from dynakin.results.estimate import Estimate
from dynakin.results.files.config import versions
from dynakin.results.measures.metrics import SCHEMA_VERSION
from dynakin.results.measures.sources import MEANINGS

_UNITS = {
    "coordinates": "rad or m, see coordinate_type",
    "coupled_coordinates": "rad or m, see coupled_coordinate_type",
    "speeds": "rad/s or m/s, see coordinate_type",
    "accelerations": "rad/s2 or m/s2, see coordinate_type",
    "moments": "N m for rotations, N for translations",
    "markers": "m",
    "mass_centre_velocity": "m/s",
    "mass_centre": "m",
    "joint_loads": "N for fx fy fz, N m for mx my mz",
    "foot_wrench": "N for fx fy fz, N m for mx my mz",
    "foot_adjustment": "N for fx fy fz, N m for mx my mz",
    "wrench": "N for fx fy fz, N m for mx my mz",
    "nis": "1",
    "test_ratio": "1",
    "n_rows": "1",
    "log_likelihood": "1",
}
_SAID = "derived: from the motion; prior: how several contacts divide the load is assumed"
_FLAGS = {
    "moment_source": (MEANINGS, f"where each moment comes from; {_SAID}"),
    "joint_source": (MEANINGS, f"where each joint's load comes from; {_SAID}"),
    "foot_source": (MEANINGS, f"where each foot's wrench comes from; {_SAID}"),
    "foot_contact": (("none", "plate", "unmeasured", "shared_plate"), "contact of each foot"),
    "verdict": (("missing", "accepted", "refused"), "what became of each sensor"),
}
"""Codes by CF's conventions for flags: what 0, 1, ... mean, and of what."""
_FLAGGED = {"moments": "moment_source", "moments_sd": "moment_source", "joint_loads": "joint_source"} | dict.fromkeys(
    ("foot_wrench", "foot_wrench_sd"), "foot_source"
)
_SMALL = 1000  # values; fewer are not worth compressing
_MOST_ROWS = 4096  # of a chunk
_COMPRESSION = 1  # of 9; 4 takes twice as long for 4 % less
_SHARE_OF_SD = 1e-4  # who takes second differences sees a thousandth
_SD_BITS = 12
_COVARIANCE_BITS = 32
"""The smallest eigenvalues of a covariance are differences of large numbers."""
_STEPS = {"markers": 2.0**-20, "joint_centres": 2.0**-20, "joint_orientations": 2.0**-20, "joint_loads": 2.0**-10}
"""About 1 µm, 1e-6 of a direction's cosine, 1 mN and 1 mN m. Powers of two leave zeros at the end, which compress."""
ONE_AT_A_TIME = Lock()
"""Who reads or writes by the netCDF library: it lets go of the interpreter, and does not bear a second thread."""
_MORE_BYTES = 2**20
_PARAMETER_NUMBERS = ("value", "sd", "initial", "table", "lower", "upper")


def full_dataset(estimate: Estimate) -> xr.Dataset:
    """The arrays of the estimate with units, the parameters, the events, the ground frame and the configuration."""
    data = estimate.data.copy()
    for name, variable in data.data_vars.items():
        unit = next((unit for stem, unit in _UNITS.items() if str(name).startswith(stem)), None)
        if unit is not None:
            variable.attrs["units"] = unit
    numbers = {name: variable for name, variable in data.data_vars.items() if variable.dtype.kind == "f"}
    data = data.assign({name: variable.copy(data=finite(variable.values)) for name, variable in numbers.items()})
    for name, (meanings, what) in _FLAGS.items():
        if name in data:
            data[name].attrs.update(
                long_name=what,
                flag_values=np.arange(len(meanings), dtype=data[name].dtype),
                flag_meanings=" ".join(meanings),
            )
    for name, flag in _FLAGGED.items():
        if name in data and flag in data:
            data[name].attrs["ancillary_variables"] = flag
    data["time"].attrs["units"] = "s"
    parameters, events = estimate.parameters, estimate.events
    more: dict[str, Any] = {}
    for key in _PARAMETER_NUMBERS:
        more[key] = finite([np.nan if getattr(p, key) is None else getattr(p, key) for p in parameters])
    for key in ("kind", "segment", "unit"):
        more[key] = np.array([getattr(p, key) for p in parameters], dtype=object)
    for key in ("at_bound", "estimated"):
        more[key] = np.array([getattr(p, key) for p in parameters], dtype=bool)
    more = {f"parameter_{key}": ("parameter", values) for key, values in more.items()}
    if events:
        more["event_time"] = ("event", np.array([e.time_s for e in events], dtype=float), {"units": "s"})
        more["event_frame"] = ("event", np.array([e.frame for e in events], dtype=int))
        for key in ("kind", "subject", "message"):
            more[f"event_{key}"] = ("event", np.array([getattr(e, key) for e in events], dtype=object))
    more["ground_rotation"] = (("axis", "laboratory_axis"), np.asarray(estimate.ground.rotation, dtype=float))
    more["ground_origin"] = ("laboratory_axis", np.asarray(estimate.ground.origin_L, dtype=float), {"units": "m"})
    data = data.assign_coords(parameter=[p.name for p in parameters]).assign(more)
    data.attrs.update(
        title=f"dynakin estimate of {estimate.recording.name}",
        schema_version=SCHEMA_VERSION,
        dynakin_version=versions()["dynakin"],
        model=estimate.model_name,
        frame=f"{estimate.ground.in_words}; SI, radians",
        **as_attributes(estimate.messages),
        configuration=json.dumps(with_nulls(estimate.config), default=str, allow_nan=False),
    )
    return data


def write_netcdf(estimate: Estimate, path: Path) -> None:
    """Write `full_dataset`, compressed, tables over time in single precision (6e-8 of each value) and what has a
    deviation with it in steps of 1e-4 of that at most, those of `_STEPS` in whole steps, deviations and test
    ratios to 1e-4 and covariances to 1e-10 of each entry.

    Times and constants stay as they are.
    """
    import netCDF4  # here, because only who writes waits for it

    data = full_dataset(estimate)
    encoding: dict[Hashable, dict[str, object]] = {}
    rounded: dict[Hashable, xr.DataArray] = {}
    for key, variable in data.data_vars.items():
        if variable.dtype.kind not in "fui" or variable.size <= _SMALL:
            continue
        rows, *others = variable.shape
        chunks = (min(rows, _MOST_ROWS), *others)
        encoding[key] = {"zlib": True, "complevel": _COMPRESSION, "shuffle": True, "chunksizes": chunks}
        if variable.dtype.kind == "f" and variable.ndim > 1:
            sd = data[f"{key}_sd"].values if f"{key}_sd" in data else None
            values = _rounded(str(key), variable.values, sd)
            if variable.dims[0] == "time":
                encoding[key]["dtype"] = "float32"
            rounded[key] = variable.copy(data=values)
    # By its path xarray would ask Dask who else writes it, which takes 0.3 s where it is there.
    try:
        with ONE_AT_A_TIME, netCDF4.Dataset(path, "w") as file:
            store = xr.backends.NetCDF4DataStore(file)  # type: ignore[no-untyped-call]
            data.assign(rounded).dump_to_store(store, encoding=encoding)
    except (OSError, RuntimeError):
        _raise_why(path)
        raise


def _raise_why(path: Path) -> None:
    """Of a disk that is full the library says that permission was denied, or nothing; the system says it of a file of
    that size."""
    size = path.stat().st_size if path.exists() else 0
    with path.open("wb") as file:
        file.write(bytes(size + _MORE_BYTES))
    path.unlink()


def _rounded(name: str, values: np.ndarray, sd: np.ndarray | None) -> np.ndarray:
    """Without what says nothing, which would not compress.

    Args:
        sd: deviations of the values, of their shape, where there are any.
    """
    if name.endswith("_covariance"):
        return _to_bits(values, _COVARIANCE_BITS)
    if name.endswith("_sd") or name == "test_ratio":
        return _to_bits(values, _SD_BITS)
    step: Any = next((step for stem, step in _STEPS.items() if name.startswith(stem)), 0.0)
    if sd is not None and not step:
        least = np.where(sd > 0.0, sd, np.inf).min(axis=0)  # of what has none in any frame all is kept
        step = np.where(np.isfinite(least), 2.0 ** np.floor(np.log2(_SHARE_OF_SD * least)), 0.0)
    return np.where(step > 0.0, step * np.round(values / np.where(step > 0.0, step, 1.0)), values)


def _to_bits(values: np.ndarray, bits: int) -> np.ndarray:
    """Rounded to a mantissa of so many bits: the rest, which says nothing, would not compress."""
    mantissa, exponent = np.frexp(values)
    return np.asarray(np.ldexp(np.round(np.ldexp(mantissa, bits + 1)), exponent - (bits + 1)))
