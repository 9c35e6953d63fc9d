"""
dynakin's compiled core: model, kinematics, dynamics, filter. Arrays in and out are float64 copies.
"""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray


class FunctionSpec:
    """
    sum_k coefficients[k] x**k ('polynomial'), or a function through the points (x, y), straight on beyond them: 'spline' (twice continuously differentiable cubics, as OpenSim's SimmSpline) or 'piecewise_linear'.
    """

    def __init__(self, kind: str = 'polynomial', coefficients: Sequence[float] = [], x: Sequence[float] = [], y: Sequence[float] = []) -> None: ...

    @property
    def kind(self) -> str: ...

    @kind.setter
    def kind(self, arg: str, /) -> None: ...

    @property
    def coefficients(self) -> list[float]: ...

    @coefficients.setter
    def coefficients(self, arg: Sequence[float], /) -> None: ...

    @property
    def x(self) -> list[float]: ...

    @x.setter
    def x(self, arg: Sequence[float], /) -> None: ...

    @property
    def y(self) -> list[float]: ...

    @y.setter
    def y(self, arg: Sequence[float], /) -> None: ...

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple, /) -> None: ...

class AxisSpec:
    """
    One degree of freedom, s = scale * sum_k coefficients[k] u**k (rad or m); u is the coordinate, or what the functions make of it one after the other.
    """

    def __init__(self, coordinate: str, kind: str = 'rotation', direction: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')] = ..., coefficients: Sequence[float] = [0.0, 1.0], scale: str = '', functions: Sequence[FunctionSpec] = []) -> None: ...

    @property
    def coordinate(self) -> str: ...

    @coordinate.setter
    def coordinate(self, arg: str, /) -> None: ...

    @property
    def kind(self) -> str: ...

    @kind.setter
    def kind(self, arg: str, /) -> None: ...

    @property
    def direction(self) -> Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')]: ...

    @direction.setter
    def direction(self, arg: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], /) -> None: ...

    @property
    def coefficients(self) -> list[float]: ...

    @coefficients.setter
    def coefficients(self, arg: Sequence[float], /) -> None: ...

    @property
    def scale(self) -> str: ...

    @scale.setter
    def scale(self, arg: str, /) -> None: ...

    @property
    def functions(self) -> list[FunctionSpec]: ...

    @functions.setter
    def functions(self, arg: Sequence[FunctionSpec], /) -> None: ...

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple, /) -> None: ...

class LengthTerm:
    """Adds direction * parameter to a joint's placement in its parent."""

    def __init__(self, parameter: str, direction: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')]) -> None: ...

    @property
    def parameter(self) -> str: ...

    @parameter.setter
    def parameter(self, arg: str, /) -> None: ...

    @property
    def direction(self) -> Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')]: ...

    @direction.setter
    def direction(self, arg: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], /) -> None: ...

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple, /) -> None: ...

class SegmentSpec:
    """A rigid segment and the joint by which it hangs from its parent."""

    def __init__(self, name: str, parent: str = 'ground', rotation: Annotated[NDArray[numpy.float64], dict(shape=(3, 3), order='F')] = ..., translation: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')] = ..., lengths: Sequence[LengthTerm] = [], axes: Sequence[AxisSpec] = [], inertia: Annotated[NDArray[numpy.float64], dict(shape=(10), order='C')] = ..., inertia_estimated: Sequence[bool] = ...) -> None: ...

    @property
    def name(self) -> str: ...

    @name.setter
    def name(self, arg: str, /) -> None: ...

    @property
    def parent(self) -> str: ...

    @parent.setter
    def parent(self, arg: str, /) -> None: ...

    @property
    def rotation(self) -> Annotated[NDArray[numpy.float64], dict(shape=(3, 3), order='F')]: ...

    @rotation.setter
    def rotation(self, arg: Annotated[NDArray[numpy.float64], dict(shape=(3, 3), order='F')], /) -> None: ...

    @property
    def translation(self) -> Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')]: ...

    @translation.setter
    def translation(self, arg: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], /) -> None: ...

    @property
    def lengths(self) -> list[LengthTerm]: ...

    @lengths.setter
    def lengths(self, arg: Sequence[LengthTerm], /) -> None: ...

    @property
    def axes(self) -> list[AxisSpec]: ...

    @axes.setter
    def axes(self, arg: Sequence[AxisSpec], /) -> None: ...

    @property
    def inertia(self) -> Annotated[NDArray[numpy.float64], dict(shape=(10), order='C')]: ...

    @inertia.setter
    def inertia(self, arg: Annotated[NDArray[numpy.float64], dict(shape=(10), order='C')], /) -> None: ...

    @property
    def inertia_estimated(self) -> list[bool]: ...

    @inertia_estimated.setter
    def inertia_estimated(self, arg: Sequence[bool], /) -> None: ...

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple, /) -> None: ...

class CoordinateSpec:
    """A generalised coordinate (rad or m)."""

    def __init__(self, name: str, value: float = 0.0, locked: bool = False) -> None: ...

    @property
    def name(self) -> str: ...

    @name.setter
    def name(self, arg: str, /) -> None: ...

    @property
    def value(self) -> float: ...

    @value.setter
    def value(self, arg: float, /) -> None: ...

    @property
    def locked(self) -> bool: ...

    @locked.setter
    def locked(self, arg: bool, /) -> None: ...

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple, /) -> None: ...

class ParameterSpec:
    """A geometry parameter, such as a segment's length (m)."""

    def __init__(self, name: str, value: float, estimated: bool = True) -> None: ...

    @property
    def name(self) -> str: ...

    @name.setter
    def name(self, arg: str, /) -> None: ...

    @property
    def value(self) -> float: ...

    @value.setter
    def value(self, arg: float, /) -> None: ...

    @property
    def estimated(self) -> bool: ...

    @estimated.setter
    def estimated(self, arg: bool, /) -> None: ...

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple, /) -> None: ...

class MarkerSpec:
    """A marker site on a segment (m, segment frame)."""

    def __init__(self, name: str, segment: str, position: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], measured: Sequence[bool] = [True, True, True], estimated: Sequence[bool] = [True, True, True], soft_tissue: Sequence[bool] = [False, False, False]) -> None: ...

    @property
    def name(self) -> str: ...

    @name.setter
    def name(self, arg: str, /) -> None: ...

    @property
    def segment(self) -> str: ...

    @segment.setter
    def segment(self, arg: str, /) -> None: ...

    @property
    def position(self) -> Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')]: ...

    @position.setter
    def position(self, arg: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], /) -> None: ...

    @property
    def measured(self) -> list[bool]: ...

    @measured.setter
    def measured(self, arg: Sequence[bool], /) -> None: ...

    @property
    def estimated(self) -> list[bool]: ...

    @estimated.setter
    def estimated(self, arg: Sequence[bool], /) -> None: ...

    @property
    def soft_tissue(self) -> list[bool]: ...

    @soft_tissue.setter
    def soft_tissue(self, arg: Sequence[bool], /) -> None: ...

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple, /) -> None: ...

class ModelSpec:
    """
    A model as plain data; Model checks and compiles it. Its lists are read as copies: assign them back.
    """

    def __init__(self, name: str, coordinates: Sequence[CoordinateSpec], parameters: Sequence[ParameterSpec], segments: Sequence[SegmentSpec], markers: Sequence[MarkerSpec], gravity: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')] = ..., wrench_measured: Sequence[bool] = [True, True, True, True, True, True], wrench_offset: Sequence[bool] = [False, False, False, False, False, False], wrench_offset_point: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')] = ..., wrench_delay: bool = False, contacts: Sequence[str] = []) -> None: ...

    @property
    def name(self) -> str: ...

    @name.setter
    def name(self, arg: str, /) -> None: ...

    @property
    def coordinates(self) -> list[CoordinateSpec]: ...

    @coordinates.setter
    def coordinates(self, arg: Sequence[CoordinateSpec], /) -> None: ...

    @property
    def parameters(self) -> list[ParameterSpec]: ...

    @parameters.setter
    def parameters(self, arg: Sequence[ParameterSpec], /) -> None: ...

    @property
    def segments(self) -> list[SegmentSpec]: ...

    @segments.setter
    def segments(self, arg: Sequence[SegmentSpec], /) -> None: ...

    @property
    def markers(self) -> list[MarkerSpec]: ...

    @markers.setter
    def markers(self, arg: Sequence[MarkerSpec], /) -> None: ...

    @property
    def gravity(self) -> Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')]: ...

    @gravity.setter
    def gravity(self, arg: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], /) -> None: ...

    @property
    def wrench_measured(self) -> list[bool]: ...

    @wrench_measured.setter
    def wrench_measured(self, arg: Sequence[bool], /) -> None: ...

    @property
    def wrench_offset(self) -> list[bool]: ...

    @wrench_offset.setter
    def wrench_offset(self, arg: Sequence[bool], /) -> None: ...

    @property
    def wrench_offset_point(self) -> Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')]: ...

    @wrench_offset_point.setter
    def wrench_offset_point(self, arg: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], /) -> None: ...

    @property
    def wrench_delay(self) -> bool: ...

    @wrench_delay.setter
    def wrench_delay(self, arg: bool, /) -> None: ...

    @property
    def contacts(self) -> list[str]: ...

    @contacts.setter
    def contacts(self, arg: Sequence[str], /) -> None: ...

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple, /) -> None: ...

class StateLayout:
    """Named blocks of the state x (3)."""

    @property
    def size(self) -> int: ...

    @property
    def names(self) -> list[str]:
        """One name an element."""

    @property
    def blocks(self) -> dict:
        """Name -> (offset, size), in order."""

class Model:
    """
    A checked, immutable model. Raises ValueError naming the key that is wrong; pickled by its ModelSpec.
    """

    def __init__(self, spec: ModelSpec) -> None: ...

    @property
    def spec(self) -> ModelSpec:
        """A copy of the specification."""

    @property
    def layout(self) -> StateLayout: ...

    @property
    def coordinate_names(self) -> list[str]: ...

    @property
    def segment_names(self) -> list[str]: ...

    @property
    def marker_names(self) -> list[str]: ...

    def initial_state(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """The specification's values (n,); speeds and accelerations 0."""

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple, /) -> None: ...

def marker_positions(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]:
    """Marker positions p_GM (M, 3), m, ground frame."""

def segment_poses(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]) -> tuple:
    """Orientations R_GB (S, 3, 3) and origins p_GB (S, 3) of all segments."""

def coordinates(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]) -> tuple:
    """q, qd, qdd of all coordinates, locked ones too: three arrays (C,)."""

def wrench(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(6), order='C')]:
    """
    Total external wrench (6,), N and N m, ground on person, about the ground origin.
    """

def total_mass(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]) -> float:
    """kg"""

def joint_moments(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)], external: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')] | None = None) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
    """
    Joint moments (1), (C,), N m or N, less the external wrenches (S, 6) that act on the segments, if given.
    """

def moment_jacobian(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)], external: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')] | None = None) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]:
    """
    d joint_moments / dx (C, n), N m or N per unit of x; the external wrenches (S, 6) stay while x varies.
    """

def fit_posture(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], targets: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], scale: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], pull: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], rest: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]) -> tuple:
    """
    Free coordinates (F,) that bring the markers nearest to targets (M, 3), m, ground frame (NaN: not measured), within bounds (F,), from those of x (n,), of which all else stays; half the sum of squares, of distances and of pull * (q - rest) (F,); whether that is a minimum.
    """

def marker_jacobian(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]:
    """d p_GM / dx (3 M, n), dense: for tests and study."""

def wrench_jacobian(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]:
    """d wrench / dx (6, n), dense: for tests and study."""

def plates(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(6), order='C')]:
    """
    What the plates should say (6,): the wrench, late by their delay, with their slow error.
    """

def plates_jacobian(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]:
    """
    d plates / dx (6, n) as the filter has it; components that are not measured are 0.
    """

class ContactLoads:
    """
    Wrenches of contacts over a trial as they are expected, how sure that is, and what touches.
    """

    def __init__(self, segments: Sequence[str], wrench: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], contact: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu', writable=False)], effects: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)] | None = None) -> None:
        """
        segments: a name a contact. wrench (T, C, 6) N and N m, on the person, about the ground origin; covariance (T, 6 C, 6 C), that of the sum positive definite; contact (T, C) uint8: 0 nothing touches, 1 on a plate, 2 not measured, 3 on a plate with another contact; effects (T, 6, 6 K): what the six states of each of the first K contacts add to its wrench, where the model has them. Raises ValueError for other shapes or codes.
        """

def contact_moments(model: Model, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)], loads: ContactLoads, frame: int = 0, covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')] | None = None, jacobian: bool = False) -> dict:
    """
    Joint moments with the contacts' wrenches of one frame, changed as little as their covariance allows to give the wrench that x needs. A dict: moments (J,), N m or N; where asked jacobian, d moments / dx (J, n); foot_wrench (C, 6) as used; foot_adjustment (C, 6), its change; remainder (6,) that no contact gives; moment_source (J,): 0 measured, 1 derived from the motion, 2 divided by a prior; with the covariance (n, n) of x also moments_sd, foot_wrench_sd.
    """

def whole_body(model: Model, states: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], segments: Sequence[str] = [], foot_wrench: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)] | None = None) -> dict:
    """
    Of states (T, n), with the wrenches foot_wrench (T, F, 6) on the named segments: mass (T,) kg, mass_centre and mass_centre_velocity (T, 3), joint_centres (T, S, 3) and orientations (T, S, 3, 3) R_GB of the segments, and joint_loads (T, S, 6): force and moment of the parent on each segment, ground axes, about its joint centre.
    """

class AtWork:
    """
    Within it a thread of the caller's counts as one that is at work in this process: the core's second threads keep off its processor (OMP_NUM_THREADS, else as many as the machine has).
    """

    def __init__(self) -> None: ...

    def __enter__(self) -> AtWork: ...

    def __exit__(self, *args: object) -> None: ...

class RecoverySettings:
    """When the motion counts as lost, and how it is sought anew."""

    def __init__(self, blind_s: float = 0.2, coordinate_sd: float = 0.5, speed_sd: float = 2.0, acceleration_sd: float = 20.0, unseen_sd: float = float('inf'), fit_m: float = 0.03) -> None: ...

class FilterSettings:
    """Noise, bounds and constraints of a Filter, SI units."""

    def __init__(self, process_variance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], marker_variance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], wrench_covariance: Annotated[NDArray[numpy.float64], dict(shape=(6, 6), order='F')], reference_point: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C')], total_mass: float | None, total_mass_variance: float, lower: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], upper: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], constraint: str = 'gain', process_density: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')] | None = None, decay_rate: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')] | None = None, equality: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')] | None = None, equality_value: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')] | None = None, marker_gate: Sequence[float] | None = None, wrench_gate: Sequence[float] | None = None, wrench_needs_markers: bool = False, iterate_beyond: float = float('inf'), recovery: RecoverySettings | None = None) -> None: ...

    @property
    def process_variance(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]: ...

    @property
    def marker_variance(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]: ...

    @property
    def wrench_covariance(self) -> Annotated[NDArray[numpy.float64], dict(shape=(6, 6), order='F')]: ...

    @property
    def lower(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]: ...

    @property
    def upper(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]: ...

class StepReport:
    """What one step did."""

    @property
    def status(self) -> str: ...

    @property
    def diverged(self) -> bool: ...

    @property
    def tracking(self) -> str:
        """following, doubtful, lost, found or restarted"""

    @property
    def n_rows(self) -> int:
        """measured rows that were used"""

    @property
    def constrained(self) -> int:
        """elements moved onto a bound, or constraints that bind"""

    @property
    def constraints_met(self) -> bool: ...

    @property
    def nis(self) -> float:
        """normalised innovation squared, summed over the rows"""

    @property
    def log_likelihood(self) -> float: ...

class Filter:
    """The constrained extended Kalman filter; one thread at a time."""

    def __init__(self, model: Model, settings: FilterSettings, x0: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], P0: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')]) -> None: ...

    @property
    def state(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """x (n,)"""

    @property
    def covariance(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')]:
        """P (n, n)"""

    @property
    def verdicts(self) -> list[str]:
        """
        missing, accepted or refused: each marker in the last update and, last, the plates
        """

    def report_sensors(self, on: bool) -> None:
        """
        From now on, or no longer, each update also works out what `sensors` gives.
        """

    @property
    def sensors(self) -> dict:
        """
        What each sensor said in the last update, if `report_sensors` is on: innovation (measured less predicted) and innovation_sd (3 M + 6,), 3 a marker, then the plates'; test_ratio (M + 1,): normalised innovation squared over the gate's limit, 0 without a gate. NaN: not measured.
        """

    def reset(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], P: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')]) -> None: ...

    def predict(self, dt: float) -> None:
        """Moves the state by dt seconds."""

    def update(self, markers: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], wrench: Annotated[NDArray[numpy.float64], dict(shape=(6), order='C')], wrench_covariance: Annotated[NDArray[numpy.float64], dict(shape=(6, 6), order='F')] | None = None, wrench_effects: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')] | None = None) -> StepReport:
        """
        Corrects with markers (M, 3), m, and wrench (6,), N and N m about the ground origin; NaN: missing. wrench_covariance (6, 6), about the ground origin, takes the place of the settings' in this frame.
        """

    def step(self, dt: float, markers: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], wrench: Annotated[NDArray[numpy.float64], dict(shape=(6), order='C')], wrench_covariance: Annotated[NDArray[numpy.float64], dict(shape=(6, 6), order='F')] | None = None, wrench_effects: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')] | None = None) -> StepReport:
        """predict(dt), then update(markers, wrench, wrench_covariance)."""

    def run(self, time: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], markers: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], wrench: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], progress: object | None = None, output_sd: bool = False, state_only: bool = False, feet: ContactLoads | None = None, wrench_covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)] | None = None, wrench_effects: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)] | None = None) -> dict:
        """
        Runs over time (T,), markers (T, M, 3) and wrench (T, 6); the first frame is an update only. Returns arrays by name; wrench_covariance (T, 6, 6), about the ground origin, takes the place of the settings', and wrench_effects (T, 6, 6 C) is what the states of the contacts take from it; with output_sd also markers_sd, wrench_sd (of the body's own wrench) and moments_sd; with state_only nothing of markers, wrenches and moments, nor of what was expected of sensors. With feet the moments are those of contact_moments, and foot_wrench, foot_adjustment, remainder, moment_source (and foot_wrench_sd) come with them. Raises DivergenceError naming the frame. progress(done, total) is called now and then.
        """

    def run_smoothed(self, time: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], markers: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], wrench: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], progress: object | None = None, outputs: bool = False, stretch: int = 0, feet: ContactLoads | None = None, wrench_covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)] | None = None, wrench_effects: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)] | None = None) -> dict:
        """
        run, then backwards over the same frames: the arrays of run (of markers_estimated, wrench_estimated, moments and the feet with `outputs` alone, then with deviations), and smoothed_state, _markers, _wrench and _moments, each also with _sd, and backward_us. The filter then stands where run would have left it; after an interruption it stands anywhere. progress counts both ways: total is twice the frames. Memory in addition to the arrays: T / stretch checkpoints and stretch frames, twice as many where a second thread helps; 0: sqrt(T). It helps where fewer threads smooth in this process than OMP_NUM_THREADS says (else: than the machine has), and changes no bit. Raises ValueError where bounds are kept by constraint 'gain' or 'sigmoid'.
        """

    def run_lagged(self, time: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], markers: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], wrench: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], lag: int, progress: object | None = None, feet: ContactLoads | None = None, wrench_covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)] | None = None, wrench_effects: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)] | None = None) -> dict:
        """
        run_smoothed's arrays (but backward_us), where each frame is smoothed from the frames until `lag` later alone, as a FixedLag gives it while it is measured; the last ones from those that there are. Time goes with frames times lag. Raises as run_smoothed.
        """

    def score(self, time: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], markers: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], wrench: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], first: int, end: int, ahead: int = 0, lost_m: float = float('inf'), trace: bool = False) -> dict:
        """
        run for its figures alone, over frames 0 to end - 1, of which those from first on count: sums of squares and counts a channel (3M + 6: markers, then the body's own wrench) of the estimate (estimated_), of the expectation before the frame (predicted_) and of that so many frames earlier (ahead_); sums of nis, log_likelihood, n_rows, refused sensors; frames counted and done; divergence, a word where the filter diverged or the markers were further off than lost_m for ten frames, which ends the run. With trace also state (T, n) and moments (T, C).
        """

class FixedLag:
    """
    Steps a Filter and smooths the frame that lies `lag` frames back, from all frames until now.
    """

    def __init__(self, filter: Filter, lag: int) -> None:
        """
        The filter stands before the first frame and is stepped by this object alone. Each step costs in proportion to the lag; so do state_sd and covariance, which are worked out where they are asked for: half a filter step for each frame of the lag.
        """

    def step(self, dt: float, markers: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], wrench: Annotated[NDArray[numpy.float64], dict(shape=(6), order='C')], wrench_covariance: Annotated[NDArray[numpy.float64], dict(shape=(6, 6), order='F')] | None = None, wrench_effects: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')] | None = None) -> StepReport:
        """
        As of Filter.step: dt s since the frame before (the first frame is an update only), markers (M, 3), wrench (6,).
        """

    @property
    def lag(self) -> int:
        """frames"""

    @property
    def ready(self) -> bool:
        """whether there is a smoothed frame yet"""

    @property
    def delay_s(self) -> float:
        """how far the smoothed frame lies back"""

    @property
    def state(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """smoothed x (n,) of the frame delay_s ago"""

    @property
    def state_sd(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
        """its standard deviations (n,)"""

    @property
    def covariance(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='F')]:
        """
        its covariance (n, n): of all pairs of states of which none is a marker's own place or soft tissue, and of those that move the same marker; 0 elsewhere
        """
