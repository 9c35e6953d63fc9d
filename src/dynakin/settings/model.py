"""What of a model is estimated, with which prior standard deviations at the first frame, and within which bounds of
equation (9): every number, with its reason.

The paper gives the bounds as +-20 % and says nothing of P at the first frame; a prior of 1e6 would let the
gauges of the model (a terminal segment's length against its free markers, say) wander, so all are finite
here.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field

from dynakin.settings.strict import Called

Quantity = Literal["lengths", "markers", "soft_tissue", "inertia"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
"""Parameters that can be estimated: segment lengths, marker places, displacements of skin and flesh, inertia."""

Positive = Annotated[float, Field(gt=0.0)]


class Priors(Called, use_attribute_docstrings=True):
    """Standard deviations of the state at the first frame."""

    renamed: ClassVar = {
        "rotation_deg": "rotation_sd_deg",
        "translation_m": "translation_sd_m",
        "rotation_speed_deg_s": "rotation_speed_sd_deg_s",
        "speed_m_s": "translation_speed_sd_m_s",
        "rotation_acceleration_deg_s2": "rotation_acceleration_sd_deg_s2",
        "acceleration_m_s2": "translation_acceleration_sd_m_s2",
        "length_fraction": "length_sd_fraction",
        "marker_m": "marker_sd_m",
        "mass_fraction": "mass_sd_fraction",
        "first_moment_fraction": "first_moment_sd_fraction",
        "inertia_fraction": "inertia_sd_fraction",
    }

    rotation_sd_deg: Positive = 5.0
    """Angles come from skin markers and regressed joint centres: soft tissue and regressions err by a few
    degrees."""
    translation_sd_m: Positive = 0.05
    """Joint translations (free-floating models), from the same landmarks."""
    rotation_speed_sd_deg_s: Positive = 60.0
    """Taken as 0 at the start; a trial may start in motion, and a squat's joints reach 100 to 150 deg/s at
    their fastest."""
    translation_speed_sd_m_s: Positive = 0.5
    """The same for translations."""
    rotation_acceleration_sd_deg_s2: Positive = 600.0
    """Taken as 0 at the start; a speed of 60 deg/s built up within 0.1 s."""
    translation_acceleration_sd_m_s2: Positive = 5.0
    """The same for translations."""
    length_sd_fraction: Positive = 0.05
    """Lengths, of their value: joint centres are known to 1 or 2 cm, 3 to 5 % of a leg segment."""
    marker_sd_m: Positive = 0.005
    """Local marker positions, measured while standing: the segment's frame hangs on the same landmarks, so one that is
    put elsewhere moves frame and places alike; what is left is the skin's shape at rest. Tried on simulated landmarks
    7 mm off: 4 to 10 mm do, the smaller the better. What skin and flesh do later is not part of it. Of models that
    are no sagittal ones: of markers that are alone on their segment, the others have the three below."""
    cluster_shift_sd_m: Positive = 0.002
    """Of the same models: all markers of a segment together against the segment. What stands measured is how they lie
    to each other; where the bone is among them is what landmarks miss, and what an .osim's scaling does."""
    cluster_turn_sd_deg: Positive = 1.0
    """The same, turned about their middle."""
    cluster_marker_sd_m: Positive = 0.0005
    """Of such models, a marker among the others of its segment, instead of `marker_sd_m`."""
    mass_sd_fraction: Positive = 0.10
    """Segment masses, of the table's value: half of the +-20 % of (9), so that the bound lies at two
    sigma."""
    worn_mass_sd_fraction: Annotated[float, Field(ge=0.0)] = 0.005
    """Of models in space: mass that a segment may have more or less than the table's, of the body's mass; its first
    moment and inertia grow with it."""
    shoe_mass_sd_fraction: Annotated[float, Field(ge=0.0)] = 0.0075
    """The same of feet, and their shoes. Tables give a foot 1.0 to 1.5 % of the body, a shoe adds 0.3 to 0.8 %, models
    for OpenSim have 2.1 to 2.5 %, and a leg that swings shows it: of simulated walks without plates,
    whose feet have 2.5 %, 61 % of the knees hold with 0.5 %, 89 with 1 (seeds 21 and 22; 1 to 4 judge);
    with 1 the two feet of a real landing come out as 1.8 and 1.3 kg, of 60."""
    first_moment_sd_fraction: Positive = 0.05
    """First moments, of mass times length: the centre of mass known to 5 % of the length."""
    inertia_sd_fraction: Positive = 0.10
    """Inertia entries, of the moment izz about the joint: mostly m c^2, so as the mass."""


class Bounds(Called, use_attribute_docstrings=True):
    """Half widths of the bounds of (9)."""

    length_fraction: Positive = 0.20
    """Of the length at the start (the paper: of the literature's; lengths are measured here)."""
    marker_threshold_m: Positive = 0.10
    """Around the initial place, each axis. The paper's Threshold is symmetric about the segment's origin and
    "tuned manually"; one number about the initial place does for all markers and keeps them on their
    segment."""
    mass_fraction: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.20
    """Of the table's mass, as in (9)."""
    first_moment_fraction: Positive = 0.20
    """Of mass times length: +-20 % of a first moment near zero is no interval."""
    inertia_fraction: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.20
    """Of the absolute value, as in (9)."""


class OpenSimOptions(Called, use_attribute_docstrings=True):
    """What of an OpenSim model can be estimated, and what is taken as the file has it."""

    scale: Literal["all"] | tuple[str, ...] | None = "all"
    """Bodies with a scale parameter, on which the joints placed on that body depend; []: none."""
    share_sides: bool = True
    """Whether mirrored bodies (femur_r, femur_l) share one."""
    scale_masses: bool = True
    """Whether all masses and inertias are multiplied so that they sum to the subject's mass."""
    lightest_share: float = Field(default=0.01, ge=0.0, lt=1.0)
    """Bodies of less than this part of the whole mass keep the file's mass and inertia: no trial identifies them."""
    lock_unseen: bool = True
    """Whether coordinates that move no measured marker (toes, often) are locked at the file's default value."""
    marker_places: Literal["calibrated", "kept"] = "calibrated"
    """Whether the .osim's marker places are calibrated by the recording, or kept as the file has them, as OpenSim's
    inverse kinematics does: kept is better where they were fitted to this person and skeleton."""
    feet: dict[Literal["right", "left"], str] = Field(default_factory=dict)
    """Bodies on which the ground acts, { right = "RFoot", left = "LFoot" }, where neither names nor markers show them;
    toes and what else hangs on them are part of the foot."""
    leave_out: tuple[str, ...] = ()
    """Markers of the file that are not measurements (regressed joint centres, say)."""
