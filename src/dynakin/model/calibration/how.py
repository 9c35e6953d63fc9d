"""How a model is calibrated: what is said of it by hand, and what is then found in the recording."""

from __future__ import annotations

from dataclasses import dataclass, field

from dynakin.recordings.frame import GroundFrame, find_ground_frame
from dynakin.recordings.landmarks import FacingPairs
from dynakin.recordings.recording import Recording
from dynakin.settings.model import Bounds, Priors


@dataclass(frozen=True, eq=False)
class Calibration:
    """How a model is calibrated on a recording.

    Attributes:
        side: limb markers of a lumped model: "right", "left", "both" (separate sites), "auto" (fewest gaps, right on a
            tie).
        vertical, forward: directions of the laboratory, found in the recording where "auto".
        priors, bounds: prior standard deviations and half widths of (9).
        ground: directions of the ground frame, where they are known already. Its origin is replaced by the model's
            ground landmark.
        measured: whether the lengths' recording has been measured before: what is doubtful of it was said then. It may
            be another trial in which nobody is to stand.
    """

    side: str = "auto"
    vertical: str = "auto"
    forward: str | tuple[float, float, float] = "auto"
    priors: Priors = field(default_factory=Priors)
    bounds: Bounds = field(default_factory=Bounds)
    ground: GroundFrame | None = None
    measured: bool = False

    def find_ground(
        self, recording: Recording, pairs: FacingPairs, static: Recording | None, *, floating: bool
    ) -> GroundFrame:
        """The ground frame as one of the recordings shows it.

        A model that is floating may head anywhere, so that nothing has to be turned back: the laboratory's own, Y up.
        With ``forward`` given X is forward, as of others.
        """
        found = find_ground_frame(recording, vertical=self.vertical, forward=self.forward, pairs=pairs, static=static)
        asked = not isinstance(self.forward, str) or self.forward.casefold() != "auto"
        return found.upright() if floating and not asked else found


AUTO = Calibration()
"""Nothing is said by hand."""
