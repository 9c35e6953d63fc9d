"""What a marker set file (TOML) may hold: markers with aliases, segments and variances; landmarks as
recipes."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from dynakin.settings.strict import Name, Strict, nearest
from dynakin.settings.subject import Sex

Vector3 = tuple[float, float, float]


class Marker(Strict):
    """One marker of the set: where it sits, under which names recordings know it, how far its place is
    trusted."""

    name: Name
    segment: str = ""  # a part of the body or a segment of the model; unused for landmark_only
    right: tuple[str, ...] = ()
    left: tuple[str, ...] = ()
    centre: tuple[str, ...] = ()
    variance: Annotated[float, Field(gt=0.0)] | None = None  # m^2, R of the measurement
    soft_tissue_mm: Annotated[float, Field(ge=0.0)] = 10.0  # how far skin and flesh move here, at full squat
    soft_tissue_in_space_mm: Annotated[float, Field(ge=0.0)] | None = None  # instead, of a model in space
    reason: str = ""
    landmark_only: bool = False  # virtual, or used for a joint centre only
    in_space: bool = False  # a measurement of models in space only; for planar ones as landmark_only

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if not (self.right or self.left or self.centre):
            raise ValueError("expected aliases in right, left or centre")
        if self.centre and (self.right or self.left):
            raise ValueError("a marker is either in the centre or on the sides, not both")
        if not self.landmark_only and (self.variance is None or not self.segment):
            raise ValueError("segment and variance are needed (or landmark_only = true)")
        return self

    def soft_tissue_m(self, planar: bool) -> float:
        """Displacement (m) that is declared to the filter: the size at full squat, or that for models in space, whose
        feet bend at the toes, and whose pelvis is held by its own markers."""
        in_space = self.soft_tissue_in_space_mm
        return 1e-3 * (self.soft_tissue_mm if planar or in_space is None else in_space)

    def measures(self, planar: bool) -> bool:
        """Whether it is a measurement of a planar model, or of one in space."""
        return not (self.landmark_only or (planar and self.in_space))

    def aliases(self, side: str) -> tuple[str, ...]:
        """Names under which a recording may have it on "right", "left" or in the "centre"."""
        return {"right": self.right, "left": self.left, "centre": self.centre}[side]


class PelvisCoefficients(Strict):
    """Centre = mid ASIS + pelvis axes * (width * ASIS distance + depth * mid ASIS to mid PSIS + constant)."""

    width: Vector3 = (0.0, 0.0, 0.0)
    depth: Vector3 = (0.0, 0.0, 0.0)
    constant_m: Vector3 = (0.0, 0.0, 0.0)


class PelvisRegression(Strict):
    """A joint centre in the ISB pelvis frame (X forward in the plane of ASIS and mid PSIS, Z to the
    right)."""

    asis: str
    psis: str
    male: PelvisCoefficients
    female: PelvisCoefficients


class PolarCoefficients(Strict):
    """Distance in units of the scale, and the turn of its direction about Z (right), positive from X to Y."""

    coefficient: float
    angle_deg: float


class PolarRegression(Strict):
    """A joint centre at a distance and angle from a marker in the sagittal plane."""

    origin: str
    along: tuple[str, str]
    scale: tuple[str, str]
    male: PolarCoefficients
    female: PolarCoefficients


class Fraction(Strict):
    """A point on the line between two landmarks, as a fraction from the first."""

    between: tuple[str, str]
    male: float
    female: float


class Offset(Strict):
    """A point offset from another: a joint centre inward of the one marker that sits over it.

    The direction is that of ``along``, or, with ``inward``, towards the body's middle plane: the mean of the line
    between the two ASIS and of the right angle to the foot (heel to toe), made square to ``square_to``; with ``bend``
    (three landmarks of a limb, proximal to distal) it is the normal of the limb's plane as far as the limb is bent.
    The distance is half of the joint's ``width`` where the recording says it (`Recording.subject`), else a fraction of
    the height or of the distance between both sides of the marker ``scale``; and ``add_m`` (a marker's radius).
    """

    origin: str
    along: tuple[str, str] | None = None
    inward: bool = False
    asis: str = ""
    foot: tuple[str, str] | None = None
    square_to: tuple[str, str] | None = None
    bend: tuple[str, str, str] | None = None
    per_height: float | None = None
    scale: str | None = None  # a marker: the distance between its two sides
    per_scale: float | None = None
    width: Literal["knee", "ankle"] | None = None
    add_m: float = 0.0

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.inward == (self.along is not None):
            raise ValueError("expected either along or inward = true")
        if self.inward and (not self.asis or self.square_to is None):
            raise ValueError("inward needs asis and square_to")
        if (self.per_height is None) == (self.per_scale is None) or (self.per_scale is None) != (self.scale is None):
            raise ValueError("expected either per_height, or scale and per_scale")
        return self

    @property
    def inputs(self) -> tuple[str, ...]:
        """Markers and landmarks it starts from, on its own side."""
        found = [self.origin]
        for several in (self.along, self.square_to, self.bend, self.foot):
            found += list(several or ())
        return tuple(dict.fromkeys([*found, *(name for name in (self.asis, self.scale) if name)]))


class Corner(Strict):
    """The point in which three arms of one length meet at right angles, from the markers at their ends.

    Of the two such points the one on the inner side: the arms point away from the body's middle, along ``asis``.
    """

    arms: tuple[str, str, str]
    asis: str


class Recipe(Strict):
    """One way to find a landmark: mean of markers or landmarks, a regression, a proportion of a line, an offset or a
    corner."""

    mean: tuple[str, ...] | None = None
    sides: Literal["own", "both", "right", "left"] = "own"  # "right", "left": that side for either side
    pelvis: PelvisRegression | None = None
    polar: PolarRegression | None = None
    fraction: Fraction | None = None
    offset: Offset | None = None
    corner: Corner | None = None
    source: str = ""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ways = ("mean", "pelvis", "polar", "fraction", "offset", "corner")
        given = [key for key in ways if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError(f"exactly one of {', '.join(ways)} expected, found {given or 'none'}")
        if given[0] != "mean" and self.sides == "both":
            raise ValueError("sides = 'both' is possible with mean only")
        if given[0] != "mean" and not self.source:
            raise ValueError(f'{given[0]}: a regression needs its source = "..."')
        return self

    @property
    def inputs(self) -> tuple[str, ...]:
        """Markers and landmarks it starts from."""
        if self.mean is not None:
            return self.mean
        if self.pelvis is not None:
            return (self.pelvis.asis, self.pelvis.psis)
        if self.polar is not None:
            return (self.polar.origin, *self.polar.along, *self.polar.scale)
        if self.offset is not None:
            return self.offset.inputs
        if self.corner is not None:
            return (*self.corner.arms, self.corner.asis)
        assert self.fraction is not None
        return self.fraction.between

    @property
    def across(self) -> tuple[str, ...]:
        """Those of the markers it starts from that it takes on both sides."""
        if self.pelvis is not None:
            return (self.pelvis.asis, self.pelvis.psis)
        if self.offset is not None:
            return tuple(name for name in (self.offset.asis, self.offset.scale) if name)
        return (self.corner.asis,) if self.corner is not None else ()


class MarkerSetFile(Strict):
    """A whole marker set: its places and clusters, or all of its markers and landmarks written out."""

    schema_version: Literal[1]
    name: Name
    description: str = ""
    source: str = ""  # where the set is published
    places: dict[str, Any] = Field(default={})  # place of the body (anatomy.toml) -> names in recordings
    clusters: dict[str, Any] = Field(default={})  # segment -> markers that only follow it; see anatomy.expanded
    heel_toe: tuple[str, str] | None = None  # markers that show where the person faces: foot,
    pelvis_back_front: tuple[str, str] | None = None  # and pelvis
    height_marker: str = ""  # marker whose height over the floor gives the body height if none is given
    height_fraction: Annotated[float, Field(gt=0.0, lt=1.5)] | None = None
    height_source: str = ""
    markers: Annotated[tuple[Marker, ...], Field(min_length=1, max_length=1000)]  # what cameras separate
    landmarks: Annotated[dict[str, tuple[Recipe, ...]], Field(max_length=300)]  # six times those of the largest set
    in_space: dict[str, tuple[Recipe, ...]] = Field(default={})  # landmarks of models in space

    def recipes(self, planar: bool) -> dict[str, tuple[Recipe, ...]]:
        """Landmarks of planar models, or of models in space."""
        return self.landmarks if planar else {**self.landmarks, **self.in_space}

    @model_validator(mode="after")
    def _references(self) -> Self:
        names = [marker.name for marker in self.markers]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"markers: the name {name!r} is given twice")
            if name in self.landmarks or name in self.in_space:
                raise ValueError(f"landmarks: {name!r} is also the name of a marker")
        self._check(self.landmarks, names)
        self._check(self.recipes(planar=False), names)
        for key in ("heel_toe", "pelvis_back_front", "height_marker"):
            value = getattr(self, key) or ()
            for name in (value,) if isinstance(value, str) else value:
                if name not in names:
                    raise ValueError(f"{key}: no marker {name!r}{nearest(name, names)}")
        return self

    def _check(self, landmarks: dict[str, tuple[Recipe, ...]], names: list[str]) -> None:
        known = {*names, *landmarks}
        for landmark, recipes in landmarks.items():
            if not recipes:
                raise ValueError(f"landmarks.{landmark}: no recipe")
            for recipe in recipes:
                for source in recipe.inputs:
                    if source not in known:
                        raise ValueError(
                            f"landmarks.{landmark}: {source!r} is neither marker nor landmark{nearest(source, known)}"
                        )

        needs = {name: {s for recipe in recipes for s in recipe.inputs} for name, recipes in landmarks.items()}
        try:
            TopologicalSorter(needs).prepare()
        except CycleError as error:
            raise ValueError(f"landmarks: {' -> '.join(reversed(error.args[1]))} is a circle") from None

    @property
    def usual(self) -> tuple[Marker, ...]:
        """Markers by which a recording is known to have this set; what only models in space use is extra."""
        used = {source for recipes in self.landmarks.values() for recipe in recipes for source in recipe.inputs}
        return tuple(marker for marker in self.markers if marker.measures(planar=True) or marker.name in used)

    def marker(self, name: str) -> Marker:
        """The marker of that name (it exists: references are checked)."""
        return next(marker for marker in self.markers if marker.name == name)


def by_sex(male: float, female: float, sex: Sex | None) -> float:
    """The number for one sex, or the mean of both where the sex is not given."""
    return male if sex == "male" else female if sex == "female" else 0.5 * (male + female)
