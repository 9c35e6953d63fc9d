"""What the filter assumes of noise: process and measurement, what it doubts, and how constraints are kept."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import Field

from dynakin.settings.strict import Called

NotNegative = Annotated[float, Field(ge=0.0)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=True)]  # infinite: as if there were no such measurement
Seconds = Annotated[float, Field(gt=0.0)]
Probability = Annotated[float, Field(ge=0.0, lt=1.0)]
JointGroup = Literal["pelvis", "trunk_rotation", "upper_body", "hips", "knees", "feet"]
"""Joints that move alike; ``pelvis``: the six coordinates of a floating model's root."""


class Scale(NamedTuple):
    """Of a setting on a scale of its own kind (a variance, deviation or time, so that a logarithm makes sense): its
    unit, and what it does in a few words."""

    unit: str
    effect: str


def scale(default: float, unit: str, effect: str) -> Any:
    """A field that can be varied, with its `Scale`."""
    return Field(default=default, json_schema_extra={"unit": unit, "effect": effect})


class Noise(Called, use_attribute_docstrings=True):
    """SI units; what is called a variance is squared. The defaults are those that anyone should use: white jerk, soft
    tissue as a process of its own, bounds by projection, gates, recovery; how each number was found stands in
    docs/validation.md."""

    renamed: ClassVar = {
        "coordinate": "coordinate_variance",
        "speed": "speed_variance",
        "acceleration": "acceleration_variance",
        "length": "length_variance",
        "marker_place": "marker_place_variance_m2",
        "inertia": "inertia_variance",
        "jerk": "jerk_density_rad2_s5",
        "jerk_translation": "translation_jerk_density_m2_s5",
        "floating_jerk": "floating_jerk_density_rad2_s5",
        "floating_jerk_translation": "floating_translation_jerk_density_m2_s5",
        "length_drift": "length_drift_density_m2_s",
        "length_skin": "length_skin_fraction",
        "soft_tissue": "soft_tissue_sd_fraction",
        "soft_tissue_least_m": "soft_tissue_least_sd_m",
        "marker_scale": "marker_variance_scale",
        "marker": "marker_variance_m2",
        "force": "force_variance_n2",
        "moment": "moment_variance_n2_m2",
        "plate_force": "plate_force_sd_n",
        "plate_moment": "plate_moment_sd_nm",
        "plate_delay_s": "plate_delay_sd_s",
        "total_mass": "total_mass_variance_kg2",
        "iterate_beyond": "iterate_beyond_sd",
    }

    coordinate_variance: NotNegative = scale(0.0, "rad² or m² a step", "how far coordinates may jump between frames")
    """Q of each coordinate, rad^2 or m^2 a step."""
    speed_variance: NotNegative = scale(0.0, "(rad/s)² or (m/s)² a step", "how far speeds may jump between frames")
    """Q of each speed, (rad/s)^2 a step."""
    acceleration_variance: NotNegative = scale(
        0.0, "(rad/s²)² or (m/s²)² a step", "how far accelerations may jump between frames"
    )
    """Q of each acceleration, (rad/s^2)^2 a step."""
    length_variance: NotNegative = scale(0.0, "m² a step", "how fast lengths may change")
    """Q of each segment length: constants."""
    marker_place_variance_m2: NotNegative = scale(0.0, "m² a step", "how fast marker places may change")
    """Q of each local marker coordinate, m^2 a step."""
    inertia_variance: NotNegative = scale(0.0, "SI² a step", "how fast inertial parameters may change")
    """Q of each inertial parameter: constants."""
    jerk_density_rad2_s5: NotNegative = scale(60.0, "rad²/s⁵", "how abruptly joints accelerate")
    """Spectral density of the jerk of each rotation, rad^2/s^5: white jerk keeps angles, speeds and accelerations
    derivatives of each other at any time step."""
    translation_jerk_density_m2_s5: NotNegative = scale(10.0, "m²/s⁵", "how abruptly the body accelerates")
    """The same of each translation, m^2/s^5."""

    floating_jerk_density_rad2_s5: NotNegative | None = scale(3e4, "rad²/s⁵", "how abruptly joints accelerate")
    """The jerk's density of each rotation of a model that is fixed nowhere: it walks, and its limbs swing. Not given:
    as ``jerk_density_rad2_s5``."""
    floating_translation_jerk_density_m2_s5: NotNegative | None = scale(
        1e3, "m²/s⁵", "how abruptly the body accelerates"
    )
    """The same of each translation."""

    length_drift_density_m2_s: NotNegative = scale(3e-6, "m²/s", "how fast lengths may change")
    """Spectral density of a random walk of each length, m^2/s: skin that follows an angle and joints that are no hinges
    look like lengths, and do not average out; without it a length is thought to be known the better the longer."""
    length_skin_fraction: NotNegative = 0.6
    """Part of the skin's declared displacement that is added to the standard deviation of the lengths about it when
    they are reported, not in the filter: skin that follows an angle never averages out."""
    systematic_scale: NotNegative = 1.0
    """Size of what is wrong in the same way in all frames with joints, skin, centres of mass and limbs without markers,
    over its usual size (`filter.uncertainty`): added to the standard deviations of angles, speeds, accelerations and
    moments when they are reported, not in the filter, of models that are fixed nowhere. What is not known of inertia is
    no part of it: it counts at least as the declared noise has it. 0: the filter's own alone, of inertia too."""
    soft_tissue_sd_fraction: NotNegative = scale(0.5, "of the declared size", "how far skin and flesh move")
    """Standard deviation of the displacement of skin and flesh under each marker, as a fraction of the size that its
    marker set declares; 0: none is estimated."""
    soft_tissue_least_sd_m: NotNegative = scale(0.002, "m", "below which size soft tissue counts as noise")
    """Where the standard deviation is below this, this much is taken for noise of the marker instead, without a state
    of its own: a foot is not as rigid, nor its toe as fixed in the ground, as a model has it."""
    soft_tissue_time_s: Seconds = scale(6.0, "s", "how long skin stays displaced")
    """Time constant of that displacement (first-order Gauss-Markov process)."""
    floating_soft_tissue_time_s: Seconds | None = scale(0.15, "s", "how long skin stays displaced")
    """The same for a model that is fixed nowhere; not given: as ``soft_tissue_time_s``. What markers show apart from
    the model goes with the movement, and skin that takes longer to come back looks like other bones. For an .osim it is
    10/3 times as long."""

    following_skin_fraction: NotNegative = 1.0
    """Prior standard deviation of the displacement of skin that follows one joint to its end, of the declared size: it
    is found in a recording that is estimated from all frames, by an .osim that is fixed nowhere, and taken off its
    markers. 0: none is."""

    marker_sd_m: Positive | None = scale(0.0007, "m", "noise of the cameras")
    """Noise of the cameras, m, for all markers; not given: R of the marker set, which holds soft tissue too."""
    marker_variance_scale: Positive = scale(1.0, "1", "noise of the markers")
    """Factor on the R of all markers that the marker set gives."""
    marker_variance_m2: dict[str, Positive] = Field(default_factory=dict)
    """R of single markers, m^2, by their name in the recording, instead of the marker set's."""
    force_variance_n2: Positive = scale(36.0, "N²", "noise of the forces")
    """R of each force component of the total wrench, N^2, of a model that stands on its root."""
    moment_variance_n2_m2: Positive = scale(4.0, "(N m)²", "noise of the moments")
    """R of each moment component about the reference point, (N m)^2."""
    reference_point_m: tuple[float, float, float] | Literal["auto"] = "auto"
    """Where the wrench's noise is declared, in the ground frame; auto: the mean centre of pressure of the first
    second."""
    plate_force_sd_n: NotNegative = scale(5.0, "N", "slow error of the forces")
    """Standard deviation of a slow error of each force (plates and model alike), N; 0: none is estimated."""
    plate_moment_sd_nm: NotNegative = scale(2.0, "N m", "slow error of the moments")
    """The same of each moment about the ground origin, N m."""
    plate_time_s: Seconds = scale(30.0, "s", "how long that error lasts")
    """Time constant of that slow error."""
    residual_force_sd_n: NotNegative = scale(12.0, "N", "what the model does not explain of the forces")
    """Of a model that is fixed nowhere: standard deviation, in each frame, of the force on its root that neither
    contacts nor the model's segments explain (soft mass, rigid segments, late accelerations). 0: the plates are changed
    until nothing is left."""
    residual_moment_sd_nm: NotNegative = scale(4.0, "N m", "what the model does not explain of the moments")
    """The same of the moment about the root. 0 with the one above."""
    plate_load_tolerance: Positive | None = 0.15
    """Plates whose load is further from the person's weight than this part of it are not used: something that the model
    does not have bears on them. Not given: they always are."""
    plate_delay_sd_s: NotNegative = 0.02
    """Prior standard deviation of the plates' delay behind the markers, s, of a model that is fixed in the ground; 0:
    none is estimated. Of one with feet it is found before (`filter.ground.fine_delay`)."""
    total_mass_variance_kg2: Positive = scale(0.25, "kg²", "doubt about the total mass")
    """Variance of the declared total mass, kg^2."""
    total_mass_use: Literal["frame", "prior"] = "prior"
    """Whether the total mass is measured at each frame (5), or known once, at the start."""

    marker_gate: Probability = 1e-9
    """A marker is refused where its innovation is less likely than this; 0: never."""
    wrench_gate: Probability = 1e-9
    """The same for the plates."""
    recover: bool = True
    """Whether a motion that most markers contradict, or that was not seen for blind_s, is searched for again."""
    blind_s: Seconds = 0.2
    """How long the motion is believed without markers that fit, s."""
    unseen_sd: Positive | None = 0.5
    """Standard deviation of a coordinate (rad or m) from which on it is held where it is, because no marker observes it
    any more; not given: it is carried on with the speed it last had. Needs ``recover``."""
    iterate_beyond_sd: Positive | None = 0.2
    """Standard deviation of a coordinate (rad or m) beyond which an update is linearised anew; not given: never."""

    adapt: bool | None = Field(default=None, examples=[True])
    """Whether the two scales below are found in the recording, by its innovations; never in a live session. Not given:
    of a model that is fixed nowhere. A preset of one's own (a file) fixes them, unless it says true."""
    variance_scale: Positive = scale(1.0, "1", "all noise but that of the plates")
    """Factor on every variance, prior ones too, but those of plates and residual. The movement is weighed as
    before: what changes is how sure of it the filter is, and how much it weighs against the plates. A factor below 1
    refuses no more markers: that, and when a coordinate counts as unseen, goes by the variances without it."""
    jerk_scale: dict[JointGroup, Positive] = Field(default_factory=dict)
    """Factor on the jerk's density of a group of joints, of a model that is fixed nowhere: pelvis, trunk_rotation
    (about its length), upper_body, hips, knees, feet; 1 where not given."""

    constraint: Literal["projection", "gain", "sigmoid", "none"] = "projection"
    """How bounds are kept: by projection in the metric of P^-1, by restricting the gain (7), by a smooth map, or not
    at all."""

    def calibrates(self, floating: bool) -> bool:
        """Whether the scales are found in the recording, of a model that is fixed nowhere or in the ground: as `adapt`
        says, else of floating models where none is given."""
        declared = self.variance_scale == 1.0 and not self.jerk_scale
        return floating and declared if self.adapt is None else self.adapt

    def scales(self) -> dict[str, Any]:
        """The scales that `adapt` finds, as plain data: a preset's table [noise] fixes them."""
        return self.model_dump(mode="json", include={"variance_scale", "jerk_scale"})


SCALES: dict[str, Scale] = {
    name: Scale(str(field.json_schema_extra["unit"]), str(field.json_schema_extra["effect"]))
    for name, field in Noise.model_fields.items()
    if isinstance(field.json_schema_extra, dict)
}
"""Settings that can be varied (`tune`), by name."""
