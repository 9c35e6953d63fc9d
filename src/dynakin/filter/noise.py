"""What the filter is told about noise: process and measurement, what it doubts, and how constraints are kept."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field
from scipy.stats import chi2

import dynakin._core as _core

Array = npt.NDArray[np.float64]
Variance = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
PositiveVariance = Annotated[float, Field(gt=0.0)]
Deviation = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Seconds = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Probability = Annotated[float, Field(ge=0.0, lt=1.0)]


class Noise(BaseModel):
    """SI units; what is called a variance is squared. The defaults are the paper's Table I, Q added at each step."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    coordinate: Variance = 1e3
    """Q of each coordinate, rad^2 or m^2 a step."""
    speed: Variance = 1e2
    """Q of each speed, (rad/s)^2 a step."""
    acceleration: Variance = 1e3
    """Q of each acceleration, (rad/s^2)^2 a step."""
    length: Variance = 0.0
    """Q of each segment length: constants."""
    marker_place: Variance = 1e-4
    """Q of each local marker coordinate, m^2 a step."""
    inertia: Variance = 0.0
    """Q of each inertial parameter: constants."""
    jerk: Variance = 0.0
    """Spectral density of the jerk of each rotation, rad^2/s^5: white jerk keeps angles, speeds and accelerations
    derivatives of each other at any time step."""
    jerk_translation: Variance = 0.0
    """The same of each translation, m^2/s^5."""

    floating_jerk: Variance | None = None
    """The jerk's density of each rotation of a model that is fixed nowhere: it walks, and its limbs swing. Not given:
    as ``jerk``."""
    floating_jerk_translation: Variance | None = None
    """The same of each translation."""

    length_drift: Variance = 0.0
    """Spectral density of a random walk of each length, m^2/s: skin that follows an angle and joints that are no hinges
    look like lengths, and do not average out; without it a length is thought to be known the better the longer."""
    length_skin: Deviation = 0.0
    """Part of the skin's declared displacement that is added to the standard deviation of the lengths about it when
    they are told, not in the filter: skin that follows an angle never averages out."""
    soft_tissue: Deviation = 0.0
    """Standard deviation of the displacement of skin and flesh under each marker, as a fraction of the size that its
    marker set declares; 0: none is estimated."""
    soft_tissue_least_m: Deviation = 0.0
    """Where the standard deviation is below this, this much is taken for noise of the marker instead, without a state
    of its own: a foot is not as rigid, nor its toe as fixed in the ground, as a model has it."""
    soft_tissue_time_s: Seconds = 1.0
    """Time constant of that displacement (first-order Gauss-Markov process)."""
    floating_soft_tissue_time_s: Seconds | None = None
    """The same for a model that is fixed nowhere; not given: as ``soft_tissue_time_s``. A step lasts half a second, and
    skin that takes longer to come back looks like longer bones."""

    marker_sd_m: Annotated[float, Field(gt=0.0)] | None = None
    """Noise of the cameras, m, for all markers; not given: R of the marker set, which holds soft tissue too."""
    marker_scale: PositiveVariance = 1.0
    """Factor on the R of all markers that the marker set gives."""
    marker: dict[str, PositiveVariance] = {}
    """R of single markers, m^2, by their name in the recording, instead of the marker set's."""
    force: PositiveVariance = 0.1
    """R of each force component of the total wrench, N^2."""
    moment: PositiveVariance = 0.1
    """R of each moment component about the reference point, (N m)^2."""
    reference_point_m: tuple[float, float, float] | Literal["auto"] = (0.0, 0.0, 0.0)
    """Where the wrench's noise is declared, in the ground frame; auto: the mean centre of pressure of the first
    second."""
    plate_force: Deviation = 0.0
    """Standard deviation of a slow error of each force (plates and model alike), N; 0: none is estimated."""
    plate_moment: Deviation = 0.0
    """The same of each moment about the ground origin, N m."""
    plate_time_s: Seconds = 1.0
    """Time constant of that slow error."""
    plate_load_tolerance: Annotated[float, Field(gt=0.0)] | None = None
    """Plates whose load is further from the person's weight than this part of it are not used: something that the model
    does not have bears on them. Not given: they always are."""
    plate_delay_s: Deviation = 0.0
    """Prior standard deviation of the plates' delay behind the markers, s; 0: none is estimated."""
    total_mass: PositiveVariance = 1e-4
    """Variance of the declared total mass, kg^2."""
    total_mass_use: Literal["frame", "prior"] = "frame"
    """Whether the total mass is measured at each frame (5), or known once, at the start."""

    marker_gate: Probability = 0.0
    """A marker is refused where its innovation is less likely than this; 0: never."""
    wrench_gate: Probability = 0.0
    """The same for the plates."""
    recover: bool = False
    """Whether a motion that most markers contradict, or that was not seen for blind_s, is sought anew."""
    blind_s: Seconds = 0.2
    """How long the motion is believed without markers that fit, s."""
    unseen_sd: Annotated[float, Field(gt=0.0)] | None = None
    """Standard deviation of a coordinate (rad or m) from which on it is held where it is, because no marker tells of it
    any more; not given: it is carried on with the speed it last had. Needs ``recover``."""
    iterate_beyond: Annotated[float, Field(gt=0.0)] | None = None
    """Standard deviation of a coordinate (rad or m) beyond which an update is linearised anew; not given: never."""

    constraint: Literal["projection", "gain", "sigmoid", "none"] = "gain"
    """How bounds are kept: by projection in the metric of P^-1, by restricting the gain (7), by a smooth map, or not
    at all."""

    def process_variance(self, layout: _core.StateLayout) -> Array:
        """Diagonal of Q (n,) a step, in the order of the state."""
        return _by_block(
            layout,
            {
                "coordinates": self.coordinate,
                "speeds": self.speed,
                "accelerations": self.acceleration,
                "lengths": self.length,
                "markers": self.marker_place,
                "inertia": self.inertia,
            },
        )

    def wrench_covariance(self) -> Array:
        """R (6, 6) of the total wrench about the reference point."""
        return np.diag([self.force] * 3 + [self.moment] * 3)

    def plate_sd(self) -> Array:
        """Standard deviations (6,) of the plates' slow error, N and N m."""
        return np.array([self.plate_force] * 3 + [self.plate_moment] * 3)

    def jerk_densities(self, floating: bool) -> dict[str, float]:
        """Density by kind of axis, of a model that is fixed in the ground or of a floating one."""
        rotation, translation = self.jerk, self.jerk_translation
        if floating:
            rotation = rotation if self.floating_jerk is None else self.floating_jerk
            translation = translation if self.floating_jerk_translation is None else self.floating_jerk_translation
        return {"rotation": rotation, "translation": translation}

    def soft_tissue_sd(self, declared_m: Array) -> Array:
        """Standard deviation (M,) m of each marker's displacement; 0 where none is estimated."""
        sd = self.soft_tissue * declared_m
        return np.where(sd < self.soft_tissue_least_m, 0.0, sd)

    def marker_variance(
        self,
        names: Sequence[str],
        of_set: Array,
        declared_m: Array,
        unmodelled_m: Array | float = 0.0,
        soft_tissue_estimated: bool = True,
    ) -> Array:
        """R (M,) m^2 of markers with these names in the recording.

        Args:
            of_set: (M,) m^2, as the marker set has it. declared_m: (M,) m, size of the soft tissue's displacement.
            unmodelled_m: (M,) m, of ``CalibratedModel``; the marker set's R holds it already.
            soft_tissue_estimated: False: all of the displacement is noise.
        """
        variance = self.marker_scale * of_set
        if self.marker_sd_m is not None:
            unmodelled = np.where(self.soft_tissue_sd(declared_m) == 0.0, self.soft_tissue_least_m, 0.0)
            if not soft_tissue_estimated:
                unmodelled = np.maximum(self.soft_tissue * declared_m, self.soft_tissue_least_m)
            variance = self.marker_sd_m**2 + unmodelled**2 + unmodelled_m**2
        return np.array([self.marker.get(name, value) for name, value in zip(names, variance, strict=True)])


def gate_limits(probability: float) -> list[float] | None:
    """Largest normalised innovation squared that is believed of 1 to 6 rows; None: no gate."""
    return None if probability == 0.0 else [float(chi2.isf(probability, rows)) for rows in range(1, 7)]


def _by_block(layout: _core.StateLayout, values: dict[str, float]) -> Array:
    return np.concatenate([np.full(size, values.get(name, 0.0)) for name, (_, size) in layout.blocks.items()])
