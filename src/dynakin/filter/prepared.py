"""A recording as the filter is going to take it: what is known before anything is estimated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dynakin.arrays import Flags
from dynakin.filter.contacts import RESIDUAL, ContactLoads
from dynakin.filter.ground.carried import says_carried
from dynakin.filter.ground.ground import Ground
from dynakin.filter.labels import labels
from dynakin.filter.measurements import Measurements
from dynakin.filter.sight import hidden_segments
from dynakin.filter.sources import ContactSources
from dynakin.filter.tracker import Tracker
from dynakin.messages import Message
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.recording import Recording
from dynakin.results.measures.sources import ABSENT, DERIVED, MEASURED, source_figures


@dataclass(frozen=True, eq=False)
class Prepared:
    """What `Estimator.prepare` gives, and `Estimator.follow` takes: a run up to its estimate.

    Attributes:
        tracker: at its start.
        measured: what the filter takes: the total wrench as the plates measure it, and each contact's (None of a model
            that stands on its root).
        ground: what is known of the ground reaction.
        lag_s: each frame is to be estimated from the frames until so much later; inf: from all.
        unsmoothed: a sentence where there is no smoother.
    """

    recording: Recording
    tracker: Tracker
    measured: Measurements
    ground: Ground
    lag_s: float
    unsmoothed: tuple[Message, ...]

    @property
    def calibrated(self) -> CalibratedModel:
        """The model of the person, with the states that the noise asks for."""
        return self.tracker.calibrated

    @property
    def messages(self) -> list[Message]:
        """What there is to say of the recording, the model and the plates, in the words of a run."""
        doubt = [self.ground.doubt] if self.ground.doubt else []
        return [*self.recording.notes, *self.calibrated.messages, *self.ground.notes, *doubt, *self.unsmoothed]

    def undeclared(self, contacts: ContactLoads | None) -> Flags:
        """(T,) frames in which something bears the person that no plate measures, by these contacts (``contacts``, or
        them in step with the markers) where they say so."""
        if contacts is None or contacts.names[-1] != RESIDUAL:
            return self.ground.undeclared
        return contacts.undeclared

    def moment_figures(self) -> dict[str, Any]:
        """Which moments will be measured, derived, a prior and absent, and why, as `moment_figures` of an estimate;
        frames in which the filter will lose the person or refuse the plates are not known yet."""
        import xarray as xr  # the slowest library of all: what precedes the core does without

        calibrated, contacts = self.calibrated, self.measured.contacts
        known = ContactSources.of(calibrated)
        sources = known.moments(contacts, carried=says_carried(self.ground.notes))
        if contacts is None:
            blind = np.isnan(self.measured.wrench).all(axis=1)
            codes = np.where(self.ground.undeclared, ABSENT, np.where(blind, DERIVED, MEASURED))
            sources = np.maximum(sources, codes[:, None]).astype(np.uint8)
        hidden = hidden_segments(self.tracker.core_model, calibrated.x0, self.measured.markers, self.recording.time)
        sources[known.unseen(hidden, len(sources))] = ABSENT
        data = xr.Dataset(coords=labels(self.tracker.core_model, calibrated, self.recording.time, contacts))
        if contacts is not None:
            data = data.isel(foot=[name != RESIDUAL for name in contacts.names])
        reasons = [reason.text for reason in self.ground.reasons]
        return source_figures(data, sources, reasons, plates=bool(self.recording.plates))
