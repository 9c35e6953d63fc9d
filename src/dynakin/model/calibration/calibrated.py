"""The outcome of a calibration: a model of one person, from which the filter starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.lumping import PlacedPart
from dynakin.model.plan import ModelPlan
from dynakin.model.spec import in_layout
from dynakin.model.state_priors import JointPrior
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.pushes import LOADED_N
from dynakin.recordings.recording import Recording
from dynakin.tree import Tree

Hips = Literal["measured", "functional", "supposed", "proportions"]

UNMARKED_SHARE = 0.09
"""Part of the mass that may be unmarked before it counts: head and hands, of which recordings often have no markers."""

HEAVY_KG_M2 = 32.0
"""Body mass index beyond which a belly counts. The tables' persons have 20 to 28; 25 kg more on the trunk of somebody
of 1.70 m (34 kg/m2) moved L5/S1 by 25 N m in simulated walks, 22 kg that lie 4 cm farther in front by 48, and 30 kg/m2
is short persons of any build as well."""


@dataclass(frozen=True, eq=False)
class StartingState:
    """What is known of each element of the state before the filter starts; order of n: the core's layout.

    Attributes:
        names: (n,) names of the state's elements.
        x0: (n,) state at the first usable frame; speeds and accelerations 0.
        sd0: (n,) prior standard deviations.
        lower, upper: (n,) bounds of (9), infinite where there are none.
        table: (n,) values of the inertia table, NaN for elements that it does not hold.
    """

    names: tuple[str, ...]
    x0: Array
    sd0: Array
    lower: Array
    upper: Array
    table: Array


@dataclass(frozen=True, eq=False)
class Coupled:
    """Coordinates that are functions of others.

    Attributes:
        spec: sliders in the ground, whose places are the values. kinds: name -> "rotation" or "translation", and the
            coordinate that it follows.
    """

    spec: _core.ModelSpec
    kinds: dict[str, tuple[str, str]]

    def values(self, names: list[str], coordinates: Array) -> Array:
        """(T, K) rad or m of the coupled ones, for coordinates (T, C) of these names."""
        model = _core.Model(self.spec)
        states = np.tile(model.initial_state(), (len(coordinates), 1))
        states[:, : len(model.coordinate_names)] = coordinates[:, [names.index(n) for n in model.coordinate_names]]
        places = _core.whole_body(model, np.ascontiguousarray(states))["joint_centres"]
        return np.asarray(places[:, [model.segment_names.index(name) for name in self.kinds], 0])


@dataclass(frozen=True)
class Provenance:
    """Where the places of markers and joints come from, as far as it makes them less sure.

    Attributes:
        guessed_places: whether the places of the markers were guessed, because no marker set has their names.
        unmarked_joints: knees and ankles that no marker shows, where the movement (`legs_in_motion`) or proportions
            have them.
        one_sided_joints: knees and ankles with a lateral marker alone and no measured width: their centres lie half an
            adult's joint width inwards.
        moved_joints: knees and ankles whose markers sit otherwise in the standing trial than in the trial.
        laid_axes: segments at whose joints the axes are not marked: forearms whose elbow has one epicondyle marked (its
            axis is square to the arm as it is bent), feet without a heel or toe (proportions have the foot's line).
        hips: where their centres come from: markers of the pelvis; functional trials; supposed, where some of these
            markers are put where two others or the other side have them, or sit otherwise in the trial; or proportions
            of an adult.
    """

    guessed_places: bool = False
    unmarked_joints: tuple[str, ...] = ()
    one_sided_joints: tuple[str, ...] = ()
    moved_joints: tuple[str, ...] = ()
    laid_axes: tuple[str, ...] = ()
    hips: Hips = "measured"


@dataclass(frozen=True, eq=False)
class CalibratedModel(StartingState):
    """A model calibrated on one person, and the state from which the filter starts.

    Attributes:
        spec: the core's specification.
        marker_variance: (M,) m^2, R of each marker as its set gives it.
        soft_tissue_m: (M,) declared size of the displacement of skin and flesh under each marker.
        ground: ground frame whose origin is the model's ground landmark (the toe).
        plate_centre: (3,) m, ground frame: mean centre of pressure of the first second on the plates, the ground's
            origin where nothing was measured.
        recorded_markers: names in the recording, in the order of spec.markers.
        side: "right", "left" or "both".
        mass_kg, height_m: as used; height None where nothing needed it.
        parts: the table's parts in each segment, as placed.
        messages: sentences on what was found, left out, locked or assumed.
        plan: the same as plain data; None for an OpenSim model.
        feet: "right", "left" -> segment on which the ground acts; empty for a model fixed in the ground.
        contacts: name -> segment, of the contacts that are declared in addition to the feet (a seat, hands on a rail).
        markers_of_fixed_feet: of a model fixed in the ground: "right", "left" -> the recording's names of the markers
            on that foot, whichever of them are sites.
        unmodelled_m: (M,) or one for all, m: standard deviation of what neither a state nor the cameras explain of each
            marker; it is added to the noise of the cameras.
        skin_lasts: how many times longer skin stays displaced than the noise settings say of a floating model.
        dimensionless: geometry parameters that are factors, not lengths.
        carried_kg: mass of the known loads (`declared.with_loads`), not in ``mass_kg``.
        height_stated: whether the height is somebody's word, and not estimated from markers.
        own_inertia: whether inertia was identified of this person, and is not the table's.
        unmarked_kg: mass of the segments that no marker shows, and that hang still on their neighbours.
        held: coordinate -> why nothing shows it, where it is held at an angle for lack of markers: results have none.
        provenance: where places of markers and joints come from.
        joint_prior: how elements hang together at first; the others are independent.
        unshown_sd: element -> the part of its prior deviation that the recording does not show, and that ``sd0`` is
            without: it is not estimated (`filter.augment.with_hips_shown`).
        coupled: coordinates of an OpenSim model that follow others, and are none of ``spec``.
        in_radians: rotations, of ``coupled`` too, that OpenSim takes from a table in degrees as radians all the same.
    """

    spec: _core.ModelSpec
    marker_variance: Array
    soft_tissue_m: Array
    ground: GroundFrame
    plate_centre: Array
    recorded_markers: tuple[str, ...]
    side: str
    mass_kg: float
    height_m: float | None
    parts: dict[str, list[PlacedPart]]
    messages: tuple[Message, ...]
    plan: ModelPlan | None
    feet: dict[str, str] = field(default_factory=dict)
    markers_of_fixed_feet: dict[str, list[str]] = field(default_factory=dict)
    unmodelled_m: Array | float = 0.0
    skin_lasts: float = 1.0
    dimensionless: frozenset[str] = frozenset()
    carried_kg: float = 0.0
    height_stated: bool = False
    own_inertia: bool = False
    unmarked_kg: float = 0.0
    held: dict[str, str] = field(default_factory=dict)
    provenance: Provenance = Provenance()
    joint_prior: JointPrior | None = None
    unshown_sd: dict[str, float] = field(default_factory=dict)
    contacts: dict[str, str] = field(default_factory=dict)
    coupled: Coupled | None = None
    in_radians: frozenset[str] = frozenset()

    @property
    def heavy(self) -> bool:
        """Whether the person is heavier for the height than those of the inertia tables: their trunk's centre of mass
        is not this person's. By a height that is somebody's word."""
        return self.height_stated and self.heavy_as_measured

    @property
    def heavy_as_measured(self) -> bool:
        """The same by any height, one that was estimated from markers too."""
        if self.plan is None or self.height_m is None:
            return False
        return self.mass_kg > HEAVY_KG_M2 * self.height_m**2

    def unlike_the_tables(self) -> list[Message]:
        """A warning where the inertia is a table's that is not for this person."""
        if not self.heavy or self.own_inertia or self.height_m is None:
            return []
        index = self.mass_kg / self.height_m**2
        text = (
            f"{self.mass_kg:.0f} kg at {self.height_m:.2f} m ({index:.0f} kg/m2) is more than the inertia tables hold: "
            "a belly lies in front of where they have the trunk's centre of mass. Moments of the lumbar spine may be "
            "off by 25 N m and more (their deviations hold about 25), those of the hips by less."
        )
        return [warning("physique", text)]

    @property
    def prior_sd(self) -> dict[str, float]:
        """Element -> standard deviation before anything is seen, shown or not."""
        known = zip(self.names, self.sd0, strict=True)
        return {name: float(np.hypot(sd, self.unshown_sd.get(name, 0.0))) for name, sd in known}

    @property
    def tree(self) -> Tree:
        """Which segment hangs on which."""
        return Tree.of(self.spec.segments)

    @property
    def weighed_kg(self) -> float:
        """What the plates carry: the person and the known loads, kg."""
        return self.mass_kg + self.carried_kg

    @property
    def unseen_kg(self) -> float:
        """Mass whose motion no marker shows, beyond that of head and hands."""
        return max(0.0, self.unmarked_kg - UNMARKED_SHARE * self.mass_kg)

    @property
    def unmarked_feet(self) -> dict[str, str]:
        """Those of ``feet`` that no marker shows, nor what hangs on them; a single one is none where the other foot has
        more: it shows neither how the foot lies nor where its load may be."""
        shown = {side: len(own) for side, own in self._on_feet().items()}
        least = 2 if max(shown.values(), default=0) > 1 else 1
        return {side: foot for side, foot in self.feet.items() if shown[side] < least}

    @property
    def foot_markers(self) -> dict[str, list[str]]:
        """Foot -> the recording's names of the markers on its segment, and on those that hang on that (toes); none of
        `unmarked_feet`."""
        if not self.feet:
            return self.markers_of_fixed_feet
        unmarked = self.unmarked_feet
        return {side: [] if side in unmarked else own for side, own in self._on_feet().items()}

    def _on_feet(self) -> dict[str, list[str]]:
        tree, pairs = self.tree, list(zip(self.recorded_markers, self.spec.markers, strict=True))
        return {
            side: [name for name, marker in pairs if marker.segment in (foot, *tree.below(foot))]
            for side, foot in self.feet.items()
        }

    def measured_plan(self) -> ModelPlan:
        """The plan.

        Raises:
            ModelError: there is none, for an OpenSim model.
        """
        if self.plan is None:
            raise ModelError(
                f"model {self.spec.name} comes from an OpenSim file; expected a built-in model or a .toml file for this"
            )
        return self.plan


def starting_state(
    spec: _core.ModelSpec,
    *,
    bounds: Mapping[str, tuple[float, float]],
    prior: Mapping[str, float],
    table: Mapping[str, float],
    speeds: Mapping[str, float],
) -> tuple[StartingState, list[Message]]:
    """The state that a specification starts with, within its bounds, and a sentence on each element that is put there.

    Args:
        bounds, prior, table: by element; infinite, NaN and NaN of what is not named. speeds: by coordinate.
    """
    core = _core.Model(spec)
    names = list(core.layout.names)
    x0 = np.array(core.initial_state(), dtype=float)
    for k, name in enumerate(names):
        if name.endswith("/speed"):
            x0[k] = speeds.get(name.removesuffix("/speed"), x0[k])
    lower = in_layout(names, {name: pair[0] for name, pair in bounds.items()}, -np.inf)
    upper = in_layout(names, {name: pair[1] for name, pair in bounds.items()}, np.inf)
    said = [
        note(
            "details",
            f"Start of {names[k]} ({x0[k]:.3f}) lies beyond its bounds {lower[k]:.3f} to {upper[k]:.3f}: put on the "
            "bound.",
        )
        for k in np.flatnonzero((x0 < lower) | (x0 > upper))
    ]
    within = np.clip(x0, lower, upper)
    sd0, table_values = in_layout(names, prior, np.nan), in_layout(names, table, np.nan)
    return StartingState(tuple(names), within, sd0, lower, upper, table_values), said


def first_centre_of_pressure(recording: Recording, ground: GroundFrame) -> Array:
    """Mean centre of pressure (3,) m of the first second on the plates, on the ground (y = 0), ground frame; 0 without
    plates."""
    if not recording.plates:
        return np.zeros(3)
    plates = [plate.wrench for plate in recording.plates]
    wrench = ground.wrench_to_ground(np.nansum(plates, axis=0))  # one that is dead hides no other
    on = np.flatnonzero(wrench[:, 1] > LOADED_N)
    loaded = wrench[on][recording.time[on] < recording.time[on[:1]] + 1.0]
    if not len(loaded):
        return np.zeros(3)
    x, z = pressed_at(loaded.mean(axis=0))
    return np.array([x, 0.0, z])
