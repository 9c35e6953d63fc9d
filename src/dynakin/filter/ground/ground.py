"""What is known of the ground reaction: of a recording once plates, feet and motion were asked, live of a moment."""

from __future__ import annotations

from dataclasses import dataclass, replace

from dynakin.arrays import Flags
from dynakin.filter.ground.plate_errors import NO_ERRORS, PlateErrors
from dynakin.messages import Message
from dynakin.recordings.feet.loads import FootLoads


@dataclass(frozen=True, eq=False)
class Ground:
    """What is known of the ground reaction over T frames.

    Attributes:
        loads: of each foot; None of a model that stands on its root.
        undeclared: (T,) frames in which something bears or pulls the person that no plate measures (a seat, a rail, a
            cable), wherever it acts: of the moments only those between the plates and the thighs are known.
        bears: (T, C) frames in which each declared contact bears, or may, where no plate measures it.
        usable: whether the plates are used at all.
        errors: by how much more than usual the plates may be off.
        load_ratio: what they carry over what the declared mass needs (`Closure`); None where that is not known.
        notes: what there is to say. reasons: those of them that say why something is not measured.
        behind_s: by how much the plates lagged behind the markers and were brought into step. clock_sd_s: how far they
            may be out of it still; 0: no farther than usual.
        in_hands_kg: what the plates carry more than the mass, where that is more than they are usually off by: the
            hands may hold it.
        doubt: a sentence where the plates contradict the mass.
    """

    loads: FootLoads | None
    undeclared: Flags
    bears: Flags
    usable: bool
    errors: PlateErrors = NO_ERRORS
    load_ratio: float | None = None
    notes: tuple[Message, ...] = ()
    reasons: tuple[Message, ...] = ()
    behind_s: float = 0.0
    clock_sd_s: float = 0.0
    in_hands_kg: float = 0.0
    doubt: Message | None = None

    def with_turn(self, found: PlateErrors) -> Ground:
        """The same, with what is wrong with the plates' moment about the vertical."""
        said = (*self.errors.said, *found.said)
        gain = found.turn_gain_error
        errors = replace(self.errors, turn_error_nm=found.turn_error_nm, turn_gain_error=gain, said=said)
        return replace(self, errors=errors, notes=(*self.notes, *found.said))
