"""Whether a session's plates are used: checked once somebody stands on them, brought into step, or given up."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from dynakin.errors import RecordingError
from dynakin.filter.estimator import Estimator
from dynakin.filter.ground.delay import out_of_step_in_words
from dynakin.messages import Message, about, note, warning, warnings_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.plates.stuck import frozen_live_in_words
from dynakin.stream.fusion import Fused, Fusion
from dynakin.stream.plate_motion import LivePlateMotion
from dynakin.stream.start import check_loaded, loaded, recording_of

Array = npt.NDArray[np.float64]
Say = Callable[[str | Message], None]

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
        self._motion: LivePlateMotion | None = None
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
        asked = initial.feet and self.there and self.used
        self._motion = LivePlateMotion(initial, self.names) if asked else None

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
        """The next frame, as of `LivePlateMotion.look`: plates out of step are brought into it, of plates with other
        axes nothing is taken any more, and that they carry another mass is said."""
        asked = self._motion
        if asked is None or not asked.look(time_s, markers, wrenches, claimed, whole):
            return
        if asked.turned is not None:
            self._say(warning("plates", f"{asked.turned}. The plates are not used any more."))
            self._give_up()
        elif asked.delay is not None:
            self._fusion.plates_behind_s += asked.delay.delay_s
            self._say(f"{out_of_step_in_words(asked.delay)}; from {time_s:.2f} s on they are brought into step.")
        if asked.mass is not None and not self._mass_doubted:
            self._mass_doubted = True
            self._say(asked.mass)

    def say_frozen(self) -> None:
        """Name those that have begun to repeat one row."""
        for name, since_s in self._fusion.frozen_plates[self._said_frozen :]:
            self._said_frozen += 1
            self._say(frozen_live_in_words(name, since_s))

    def _give_up(self) -> None:
        self.used, self._motion = False, None
