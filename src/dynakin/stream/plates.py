"""Whether a session's plates are used: checked once somebody stands on them, brought into step, or given up.

Are they in step with the markers, and are their axes right? What `filter.ground` asks of a recording is asked of the
last seconds of a session.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.filter.estimator import Estimator
from dynakin.filter.ground.axes import turned_axes
from dynakin.filter.ground.delay import out_of_step_in_words, plates_delay
from dynakin.filter.ground.needed import Needed
from dynakin.filter.ground.plate_sum import doubtful_mass
from dynakin.messages import Message, about, note, warning, warnings_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.orientation import axis_vector
from dynakin.recordings.plates.stuck import frozen_live_in_words
from dynakin.stream.fusion import Fused, Fusion
from dynakin.stream.start import check_loaded, floor_plate, loaded, recording_of

Say = Callable[[str | Message], None]

WINDOW_S, FIRST_S, RARELY_S = 8.0, 4.0, 60.0
"""The last seconds are asked, after the first, then half as often each time that a movement shows nothing, at least so
often: it takes some 40 ms, and neither clocks nor axes change."""
MOVES = 0.02
"""Of the weight, standard deviation of the force that a movement needs: standing shows no clock."""
LEAST_S = 1.0
"""So much of them must be judged: by half of it a walk in step was 10 ms late."""
NEARLY_ALL = 0.95
"""Part of the frames with a load that no plate measures, from which it may be none: what the plates carry is said, too.
In fewer of them a seat is left, and what they carry is no mass."""
_STEP_S = 0.0095
"""No more than some 100 frames a second are kept: forces of the body's mass are below 6 Hz."""
_REMEDY = "Correct the plates' axes in the capture system"
_CHECKED_S, _UNLOADED = 1.0, 10  # of standing on the plates, by which they are checked; so often nobody does


class LivePlates:
    """What a session knows of its plates.

    Args:
        fusion: which gives them; told by how much they are behind. say: called with each sentence for the user.

    Attributes:
        used: whether the filter takes them.
    """

    def __init__(self, estimator: Estimator, fusion: Fusion, say: Say) -> None:
        self.there = fusion.plates is not None
        self.used = True
        self._estimator, self._fusion, self._say = estimator, fusion, say
        self._initial: CalibratedModel | None = None
        self._asks = False  # the motion, which needs feet
        self._kept: deque[tuple[float, Array, Array, bool, bool]] = deque()  # of late, as `moved` takes it
        self._asked_s: float | None = None
        self._every_s = FIRST_S
        self._mass_doubted = False
        self._said_frozen = self._unloaded = 0
        self._unchecked: deque[Fused] | None = None  # of late, while nobody has stood on them

    @property
    def names(self) -> tuple[str, ...]:
        """Of a stream without plates: none."""
        return () if self._fusion.plates is None else self._fusion.plates.names

    def measured(self, said: list[Message], usable: bool | None) -> None:
        """The person has been measured, and this was said of them: as `begin` returns."""
        self._mass_doubted = bool(warnings_of(about(said, "weight")))
        self.used, self._unchecked = usable is not False, deque() if usable is None else None

    def begins(self, initial: CalibratedModel) -> None:
        """The estimate begins, or begins anew."""
        self._initial = initial
        self._asks = bool(initial.feet) and self.there and self.used
        self._kept.clear()
        self._asked_s, self._every_s = None, FIRST_S

    def checked(self, fused: Fused) -> None:
        """Plates on which nobody stood at the start are checked once somebody has for a second."""
        if self._unchecked is None or fused.wrenches is None or self._initial is None:
            return
        kept = self._unchecked
        kept.append(fused)
        since = fused.sample.time_s - kept[0].sample.time_s
        if 0.0 <= since < _CHECKED_S:
            return
        recording = recording_of(list(kept), self._fusion.markers.names, self.names)
        kept.clear()
        if not loaded(recording):
            self._unloaded += 1
            if self._unloaded == _UNLOADED:
                text = (
                    f"The plates are not checked yet: in none of the last {_UNLOADED * _CHECKED_S:.0f} s have they "
                    "borne somebody for half of it, as they do while somebody stands or walks on them. If somebody "
                    "does, look at their channels and the unit of their forces."
                )
                self._say(note("plates", text))
            return
        self._unchecked = None
        try:
            said, usable = check_loaded(self._estimator, self._initial, recording)
        except RecordingError as error:
            said, usable = [warning("plates", f"{error.message}. The plates are not used any more.")], False
        for message in said:
            self._say(message)
        self._mass_doubted |= bool(warnings_of(about(said, "weight")))
        if not usable:
            self._give_up()

    def moved(self, time_s: float, markers: Array, wrenches: Array, claimed: bool, whole: bool) -> None:
        """The next frame: plates out of step are brought into it, of plates with other axes nothing is taken any more,
        and that they carry another mass is said.

        Args:
            markers: (M, 3) m, of the model, ground frame, NaN missing. wrenches: (P, 6) N and N m, laboratory frame.
            claimed: whether their sum is all that bears the person, by feet and plates. whole: by the motion as well.
        """
        if not self._asks or (self._kept and 0.0 <= time_s - self._kept[-1][0] < _STEP_S):
            return
        if self._kept and time_s < self._kept[-1][0]:
            self._kept.clear()
        self._kept.append((time_s, markers, wrenches, claimed, whole))
        while time_s - self._kept[0][0] > WINDOW_S:
            self._kept.popleft()
        if self._asked_s is None or time_s < self._asked_s:
            self._asked_s = time_s
        if time_s - self._asked_s < self._every_s:
            return
        self._asked_s = time_s
        self._ask()

    def _ask(self) -> None:
        initial, now_s = self._initial, self._kept[-1][0]
        assert initial is not None
        time = np.array([at for at, *_ in self._kept])
        known, whole = (np.array([one[k] for one in self._kept], dtype=bool) for k in (3, 4))
        needed = Needed(initial, time, np.stack([one[1] for one in self._kept]))
        wrenches = np.stack([one[2] for one in self._kept])  # (T, P, 6)
        total = initial.ground.vectors_to_ground(wrenches[:, :, :3].sum(axis=1))
        total = np.where(known[:, None], total, np.nan)
        if not needed.judged_s(total) >= LEAST_S:
            return
        judged = needed.judged(total)
        if needed.force[judged].std(axis=0).max() > MOVES * needed.weight:
            self._every_s = min(2.0 * self._every_s, RARELY_S)
        up = axis_vector(initial.ground.vertical)
        plates = [floor_plate(name, wrenches[:, p], up) for p, name in enumerate(self.names)]
        if turned := turned_axes(needed, plates, known, _REMEDY):
            self._say(warning("plates", f"{turned}. The plates are not used any more."))
            self._give_up()
        elif delay := plates_delay(needed, total):
            self._fusion.plates_behind_s += delay.delay_s
            self._say(f"{out_of_step_in_words(delay)}; from {now_s:.2f} s on they are brought into step.")
            self._kept.clear()  # of plates as they came until now
            self._every_s = FIRST_S
        load_kg = float(total[judged, 1].mean() / needed.force[judged, 1].mean()) * initial.weighed_kg
        mass = _other_mass(initial, load_kg, float(np.mean(~whole[known])))
        if mass is not None and not self._mass_doubted:
            self._mass_doubted = True
            self._say(mass)

    def say_frozen(self) -> None:
        """Name those that have begun to repeat one row."""
        for name, since_s in self._fusion.frozen_plates[self._said_frozen :]:
            self._said_frozen += 1
            self._say(frozen_live_in_words(name, since_s))

    def _give_up(self) -> None:
        self.used = self._asks = False


def _other_mass(initial: CalibratedModel, load_kg: float, foreign: float) -> Message | None:
    """A sentence where plates carry so much that it is another mass, by the part of the frames in which something else
    seems to bear the person."""
    if not foreign:
        return doubtful_mass(initial, load_kg)
    if foreign <= NEARLY_ALL:
        return None
    if doubtful_mass(initial, load_kg) is None:
        return warning(
            "weight",
            f"the plates carry the person's {initial.weighed_kg:.1f} kg, and something that no plate measures pushes "
            "or pulls the person all the time (a rail, a wall, a cable), or the horizontal forces are wrong: declare "
            "it as a contact, or zero the plates. Moments take the error on.",
        )
    return warning(
        "weight",
        f"the plates carry {load_kg:.1f} kg where the person weighs {initial.weighed_kg:.1f} kg, all the time: the "
        "mass or the unit of the forces is wrong, a plate is missing, or something that no plate measures bears or "
        "pulls the person (a seat, a cable).",
    )
