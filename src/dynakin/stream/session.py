"""A live session: from packets to published estimates, with a guided start."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from dynakin.blas import one_blas_thread
from dynakin.errors import DivergenceError, ModelError, StreamError
from dynakin.filter.estimator import Estimator
from dynakin.filter.live.ahead import check_ahead
from dynakin.filter.samples import Sample
from dynakin.filter.tracker import Tracker
from dynakin.messages import Message, warning
from dynakin.recordings.recording import Recording
from dynakin.settings.defaults import DELAY_S
from dynakin.settings.lag import live_lag
from dynakin.stream.fusion import Fused, Fusion
from dynakin.stream.markers import LiveMarkers
from dynakin.stream.monitor import Monitor
from dynakin.stream.plates import LivePlates
from dynakin.stream.sinks.base import LiveFrame, Sink, Started, Status
from dynakin.stream.sinks.group import SinkGroup
from dynakin.stream.sources.packets import Seam, Source
from dynakin.stream.sources.reader import Notice, Reader
from dynakin.stream.start import begin, check_labels, quietest, recording_of, stands, unknown_mass

_POLL_S = 0.005
_ASK_S = 0.1  # how often sinks are asked for wishes, and the standing person is looked at
_DEVIATIONS_S, _DELAYED_DEVIATIONS_S = 0.2, 1.0  # those of a lag take 0.6 steps for each of its frames
_SPARSE_S = 0.05  # steps are never further apart than this because the computer is slow
_CATCH_UP_S = 1.0  # with what came while the model was measured: that is left out too, but is no sign of slowness
_STANDING_S, _REPLAY_STANDING_S = (2.0, 20.0), (2.0, 3.0)  # that are asked for, and how long they are waited for
_SHORT_S, _SHORT_STANDING_S = 6.0, 0.4  # a recording
_MASS_KG = 70.0  # of a person of whom nothing is known, so that at least the movement is seen


class Live:
    """Estimates while it is measured.

    Args:
        sources: one with markers; plates from the same or another one.
        sinks: where the estimates go.
        lag_s: by how much the estimates are late, so that the frames until then help to make them; None: the
            recommended `LIVE_LAG_S`, or 0 where the noise settings have no smoother.
        ahead_s: by which ``LiveFrame.ahead`` looks ahead of the sample; 0: not at all.
        delay_s: longest wait for what is missing (`Fusion`).
        standing_s: how long the person stands still at the start; None: 2 s, of a recording of less than 6 s 0.4.
        standing_wait_s: after so long without, the quietest moment since then is taken; None: 20 s, of a recording
            3 s, or half of it.
        max_late_s: where the estimate is further behind what arrives, frames are left out; they are counted.
        static, known: see `begin`.
        wait_s: how long to wait for the sources.
        record: makes a recorder, for the viewer's button; pressed again it ends.
        say: called with each sentence for the user.
    """

    def __init__(
        self,
        estimator: Estimator,
        sources: Sequence[Source],
        sinks: Sequence[Sink] = (),
        *,
        lag_s: float | None = None,
        ahead_s: float = 0.0,
        delay_s: float = DELAY_S,
        standing_s: float | None = None,
        standing_wait_s: float | None = None,
        static: Recording | None = None,
        known: Mapping[str, tuple[float, float]] | None = None,
        wait_s: float = 30.0,
        max_late_s: float = 0.25,
        record: Callable[[], Sink] | None = None,
        say: Callable[[str], None] = print,
    ) -> None:
        self.estimator, self.sinks = estimator, SinkGroup(sinks, record, self.say)
        self.lag_s, self.ahead_s = live_lag(lag_s, estimator.noise), check_ahead(ahead_s)
        self.delay_s = delay_s
        self._standing_given = (standing_s, standing_wait_s)
        self.standing_s, self.standing_wait_s = _standing(np.inf, *self._standing_given)
        self.static, self.known = static, known
        self.max_late_s = max_late_s
        self._say = say
        self._reader = Reader(sources, wait_s)
        self._fusion: Fusion | None = None
        self._markers: LiveMarkers | None = None
        self._window: deque[Fused] = deque()
        self._standing_since: float | None = None
        self._came_s = self._ready_s = 0.0
        self._looked = self._asked = self._sd_shown = -np.inf
        self._tracker: Tracker | None = None
        self._monitor: Monitor | None = None
        self._plates: LivePlates | None = None
        self._running = False
        self._labels_checked = False
        self._subject: dict[str, float] = {}
        self._stopped = False

    @property
    def fusion(self) -> Fusion:
        """Markers and plates as they are fused, with what was wrong with them.

        Raises:
            StreamError: the streams are not known yet.
        """
        if self._fusion is None:
            raise StreamError("the session has not been opened")
        return self._fusion

    @property
    def plates(self) -> LivePlates:
        """What is known of the plates, also where there are none.

        Raises:
            StreamError: the streams are not known yet.
        """
        if self._plates is None:
            raise StreamError("the session has not been opened")
        return self._plates

    @property
    def tracker(self) -> Tracker:
        """The filter of the person who was measured last.

        Raises:
            StreamError: nobody was measured yet.
        """
        if self._tracker is None:
            raise StreamError("nobody has been measured yet, expected somebody who stands still first")
        return self._tracker

    @property
    def measured(self) -> bool:
        """Whether somebody has been measured."""
        return self._tracker is not None

    @property
    def failures(self) -> list[str]:
        """Of sinks; a session with some is not to be called a success."""
        return self.sinks.failures

    @property
    def status(self) -> Status:
        """How it goes, as of the last step."""
        return Status() if self._monitor is None else self._monitor.last

    @one_blas_thread
    def run(self) -> None:
        """Until the sources end, or `stop` is called.

        Raises:
            StreamError: a source cannot be reached, or ended before anybody was measured. ModelError, RecordingError:
                what came does not fit the model.
        """
        try:
            self._open()
            while not self._stopped and not self._reader.over:
                self._turn()
            self._take(np.inf)
            if self._reader.over and self._tracker is None:
                in_all = max(self.standing_s, self.standing_wait_s)
                raise StreamError(
                    f"the streams ended before the model was measured: {self._came_s:.1f} s came, expected "
                    f"{self.standing_s:g} s of standing, or {in_all:g} s in all, after which the "
                    "quietest moment is taken (standing_wait_s in Python, --standing-wait)"
                )
        finally:
            if self._monitor is not None and (text := self._monitor.summary(self.fusion)):
                self.say(text)
            self._reader.close()
            self.sinks.close()

    def stop(self) -> None:
        """End `run` soon; from any thread."""
        self._stopped = True

    def restart(self) -> None:
        """Begin the estimate anew from the model as it was measured, without standing."""
        if self._tracker is None:
            return
        self._tracker = self._tracker.fresh()
        self._begin_running("The estimate starts again.")

    def recalibrate(self) -> None:
        """Measure the model anew: ask to stand still."""
        self._running = False
        self._window.clear()
        self._standing_since = self._markers = None

    def _open(self) -> None:
        self.say("Waiting for the streams.")
        streams = self._reader.open()
        markers, plates = streams.markers, streams.plates
        self.standing_s, self.standing_wait_s = _standing(streams.length_s, *self._standing_given)
        self._fusion = Fusion(markers, plates, delay_s=self.delay_s)
        self._plates = LivePlates(self.estimator, self._fusion, self.say)
        assert markers is not None
        force_plates = "no plates" if plates is None else f"{len(plates.names)} plates at {plates.rate_hz:g} Hz"
        self.say(f"Streams: {len(markers.names)} markers at {markers.rate_hz:g} Hz, {force_plates}.")
        for text in streams.notes:
            self.say(text)
        if self.lag_s:
            self.say(f"Estimates come {1e3 * self.lag_s:.3g} ms late, from the frames until then (--lag 0: at once).")
        if not streams.paced:
            self.max_late_s = np.inf
        self._subject = dict(streams.subject)
        if unknown_mass(self.estimator.model, self._subject, plates is not None):
            self._subject["mass_kg"] = _MASS_KG
            text = f"the mass is not given and there are no plates; {_MASS_KG:g} kg are taken, so that moments are"
            self.say(warning("mass", f"{text} right in shape only."))
        self.sinks.begins(self._subject, self.delay_s)
        self.sinks.opened(self.fusion.markers, self.fusion.plates)

    def _turn(self) -> None:
        packet = self._reader.get(_POLL_S)
        # What waits in the queue is judged by when it arrived, however late the filter comes to it.
        now = time.monotonic() if packet is None or isinstance(packet, Notice) else packet.arrived_s
        if isinstance(packet, Notice):
            self.say(packet.text)
            if packet.fatal is not None:
                raise packet.fatal
        elif packet is not None:
            if isinstance(packet, Seam):
                self._begins_again(packet)
            else:
                self.sinks.packet(packet)
            self.fusion.push(packet)
        self._take(now)
        if now - self._asked > _ASK_S:
            self._asked = now
            for wish in dict.fromkeys(self.sinks.asked()):  # a double click is one wish
                if wish in ("restart", "recalibrate", "stop"):
                    getattr(self, wish)()
            if self._monitor is not None and self._running and not self._reader.over:
                for text in self._monitor.changes(self.fusion, now):
                    self.say(text)

    def _begins_again(self, seam: Seam) -> None:
        self.say("The recording begins again.")
        if self._monitor is not None:
            self._monitor.begins_again(seam.time_s)

    def _take(self, now_s: float) -> None:
        for came in self.fusion.poll(now_s):
            fused = self._measured(came)
            if self._running:
                if not self._behind(fused):
                    self._step(fused)
            else:
                self._stand(fused)
        self.plates.say_frozen()

    def _measured(self, fused: Fused) -> Fused:
        """A sample without markers that are no measurement."""
        if self._markers is None:
            info = self.fusion.markers
            self._markers = LiveMarkers(info.names, info.rate_hz)
        positions = self._markers.look(fused.sample.time_s, fused.positions)
        for message in self._markers.news():
            self.say(message)
        return fused if positions is fused.positions else fused.with_positions(self.fusion.markers.names, positions)

    def _behind(self, fused: Fused) -> bool:
        """Whether to leave a frame out, so that what is shown is what happens now; some are always taken."""
        assert self._monitor is not None
        since = fused.sample.time_s - self._monitor.stepped_s
        if time.monotonic() - fused.arrived_s <= self.max_late_s or not 0.0 <= since < _SPARSE_S:
            return False
        if fused.arrived_s > self._ready_s + _CATCH_UP_S:
            self._monitor.left_out += 1
        return True

    def _stand(self, fused: Fused) -> None:
        """Look for somebody who stands still; then measure the model."""
        info = self.fusion.markers
        t = fused.sample.time_s
        if self._standing_since is None:
            self._standing_since = t
            self.say(f"Stand still and upright for {self.standing_s:g} s, please.")
        self._came_s = t - self._standing_since
        self._window.append(fused)
        longest = max(self.standing_s, self.standing_wait_s) + 0.5 / info.rate_hz
        while t - self._window[0].sample.time_s > longest:
            self._window.popleft()
        if t - self._looked < _ASK_S and t >= self._looked:
            return
        self._looked = t
        if t - self._window[0].sample.time_s < self.standing_s - 1.5 / info.rate_hz:
            return
        plates = self.plates.names
        if not self._labels_checked:
            self.say(check_labels(self.estimator.model, recording_of(self._window, info.names, (), "the stream")))
            self._labels_checked = True
        since = t - self.standing_s - 0.5 / info.rate_hz
        recent = [one for one in self._window if one.sample.time_s >= since]
        recording, static = recording_of(recent, info.names, plates, subject=self._subject), self.static
        moving: list[Fused] = []
        waited = t - self._standing_since > self.standing_wait_s
        if not stands(recording):
            if not waited:
                return
            whole = recording_of(list(self._window), info.names, plates, subject=self._subject)
            recording, quiet, text = quietest(whole, weigh=not self.estimator.model.has_mass)
            static = static or quiet
            moving = [one for one in self._window if one.sample.time_s >= recording.time[0]]
            self.say(f"Nobody stood still for {self.standing_s:g} s.")
            self.say(text if self.static is None else "Lengths and marker places are those of the standing trial.")
        try:
            self._tracker, said, usable = begin(
                self.estimator,
                recording,
                static=static,
                known=self.known,
                lag_s=self.lag_s,
                rate_hz=self.fusion.markers.rate_hz,
                ahead_s=self.ahead_s,
            )
        except ModelError as error:
            if waited:
                raise
            self.say(f"{error.message}; trying again.")
            self._window.clear()
            return
        on_the_move = bool(moving) and self.static is None  # that nobody stood has been said
        for message in said:
            if not (on_the_move and message.topic == "standing"):
                self.say(message)
        self.plates.measured(said, usable)
        self._come_up(moving)
        self._begin_running("Ready: move.")

    def _come_up(self, frames: Sequence[Fused]) -> None:
        """Step through the frames on which somebody was measured who moves: the start is the first of them, and what it
        is off by when the session goes on would be taken for other marker places."""
        for fused in frames:
            try:
                self.tracker.step(self._sample(fused))
            except DivergenceError as error:
                self.say(f"{error.message}; the estimate starts again.")
                self._tracker = self.tracker.fresh()
                return

    def _sample(self, fused: Fused) -> Sample:
        return fused.sample if self.plates.used else Sample(fused.sample.time_s, fused.sample.markers)

    def _begin_running(self, text: str) -> None:
        initial = self.tracker.calibrated
        self.plates.begins(initial)
        monitor = Monitor(initial, self.fusion.markers.rate_hz, self.plates, self.estimator.noise.recover)
        if self._monitor is not None:
            monitor.go_on_from(self._monitor)
        self._monitor = monitor
        self._running = True
        self._ready_s = time.monotonic()
        self._window.clear()
        started = Started(initial, self.tracker.core_model, self.fusion.markers.rate_hz)
        self.sinks.started(started)
        self.say(text)

    def _step(self, fused: Fused) -> None:
        monitor, tracker, plates = self._monitor, self.tracker, self.plates
        assert monitor is not None
        plates.checked(fused)
        sample = self._sample(fused)
        try:
            estimate = tracker.step(sample)
        except DivergenceError as error:
            self.say(f"{error.message}; the estimate starts again.")
            self.restart()
            return
        feet, whole = tracker.feet, tracker.feet is None or tracker.feet.whole
        if feet is not None and feet.seen is not None and plates.used and fused.wrenches is not None:
            plates.moved(sample.time_s, feet.seen, fused.wrenches, feet.claimed, whole)
        smoothed = tracker.delayed() if tracker.lag else None
        state = tracker.state
        deviations = None
        every_s = _DELAYED_DEVIATIONS_S if tracker.lag else _DEVIATIONS_S
        ready = smoothed is not None or not tracker.lag
        if ready and not 0.0 <= sample.time_s - self._sd_shown < every_s and self._reader.backlog < 4:
            self._sd_shown = sample.time_s
            deviations = tracker.deviations(delayed=tracker.lag > 0)
        status = monitor.status(self.fusion, fused, whole, estimate, smoothed, state, tracker.verdicts)
        published = smoothed if tracker.lag else estimate
        ahead = tracker.ahead() if self.ahead_s else None
        frame = LiveFrame(estimate, smoothed, published, fused, state, deviations, status, ahead)
        self.sinks.frame(frame)
        monitor.published(sample.time_s, time.monotonic() - fused.arrived_s)
        news = [] if feet is None else feet.news()
        motion = monitor.motion(estimate, fused)
        for text in [*news, *motion, *monitor.settling(sample.time_s, state, tracker)]:
            self.say(text)

    def say(self, what: str | Message) -> None:
        """Say something to the user."""
        text = str(what)
        phase = "running" if self._running else "waiting" if self._standing_since is None else "standing"
        status = Status(phase=phase) if self._monitor is None or not self._running else self._monitor.last
        self._say(text)
        self.sinks.said(text, status)


def _standing(length_s: float, standing_s: float | None, wait_s: float | None) -> tuple[float, float]:
    """Seconds of standing that are asked for, and of waiting for them, where they are not given.

    Args:
        length_s: of a recording, which does not follow requests; inf: of none.
    """
    stands, waits = _STANDING_S if length_s == np.inf else _REPLAY_STANDING_S
    if length_s < _SHORT_S:
        stands, waits = _SHORT_STANDING_S, max(_SHORT_STANDING_S, 0.5 * length_s)
    return stands if standing_s is None else standing_s, waits if wait_s is None else wait_s
