"""Are the plates in step with the markers, and are their axes right? What `filter.ground` asks of a recording, asked of
the last seconds of a session."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dynakin.filter.ground.axes import turned_axes
from dynakin.filter.ground.delay import Delay, plates_delay
from dynakin.filter.ground.needed import Needed
from dynakin.filter.ground.plate_sum import doubtful_mass
from dynakin.messages import Message, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.orientation import axis_vector
from dynakin.stream.start import floor_plate

Array = npt.NDArray[np.float64]

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


class LivePlateMotion:
    """Keeps what was measured of late, and asks it.

    Attributes:
        delay: by how much the plates lag behind the markers as they come now; None where that is not known or they are
            in step.
        turned, mass: sentences where their axes are others, where they carry another mass.
    """

    def __init__(self, initial: CalibratedModel, plates: Sequence[str]) -> None:
        self._initial, self._plates = initial, tuple(plates)
        self._kept: deque[tuple[float, Array, Array, bool, bool]] = deque()
        self._asked_s: float | None = None
        self._every_s = FIRST_S
        self.delay: Delay | None = None
        self.turned: str | None = None
        self.mass: Message | None = None

    def look(self, time_s: float, markers: Array, wrenches: Array, claimed: bool, whole: bool) -> bool:
        """The next frame; whether something was found.

        Args:
            markers: (M, 3) m, of the model, ground frame, NaN missing. wrenches: (P, 6) N and N m, laboratory frame.
            claimed: whether their sum is all that bears the person, by feet and plates. whole: by the motion as well.
        """
        if self._kept and 0.0 <= time_s - self._kept[-1][0] < _STEP_S:
            return False
        if self._kept and time_s < self._kept[-1][0]:
            self._kept.clear()
        self._kept.append((time_s, markers, wrenches, claimed, whole))
        while time_s - self._kept[0][0] > WINDOW_S:
            self._kept.popleft()
        if self._asked_s is None or time_s < self._asked_s:
            self._asked_s = time_s
        if time_s - self._asked_s < self._every_s:
            return False
        self._asked_s = time_s
        self._ask()
        if self.delay is not None:
            self._kept.clear()  # of plates as they came until now
            self._every_s = FIRST_S
        return any(found is not None for found in (self.delay, self.turned, self.mass))

    def _ask(self) -> None:
        self.delay = self.turned = self.mass = None
        time = np.array([at for at, *_ in self._kept])
        known, whole = (np.array([one[k] for one in self._kept], dtype=bool) for k in (3, 4))
        needed = Needed(self._initial, time, np.stack([one[1] for one in self._kept]))
        wrenches = np.stack([one[2] for one in self._kept])  # (T, P, 6)
        total = self._initial.ground.vectors_to_ground(wrenches[:, :, :3].sum(axis=1))
        total = np.where(known[:, None], total, np.nan)
        if not needed.judged_s(total) >= LEAST_S:
            return
        judged = needed.judged(total)
        if needed.force[judged].std(axis=0).max() > MOVES * needed.weight:
            self._every_s = min(2.0 * self._every_s, RARELY_S)
        up = axis_vector(self._initial.ground.vertical)
        plates = [floor_plate(name, wrenches[:, p], up) for p, name in enumerate(self._plates)]
        self.turned = turned_axes(needed, plates, known, _REMEDY)
        self.delay = None if self.turned else plates_delay(needed, total)
        ratio = float(total[judged, 1].mean() / needed.force[judged, 1].mean())
        foreign = float(np.mean(~whole[known]))
        if not foreign:
            self.mass = doubtful_mass(self._initial, ratio * self._initial.weighed_kg)
        elif foreign > NEARLY_ALL:
            self.mass = warning(
                "weight",
                f"the plates carry {ratio * self._initial.weighed_kg:.1f} kg where the person weighs "
                f"{self._initial.weighed_kg:.1f} kg, all the time: the mass or the unit of the forces is wrong, a "
                "plate is missing, or something that no plate measures bears or pulls the person (a seat, a cable).",
            )
