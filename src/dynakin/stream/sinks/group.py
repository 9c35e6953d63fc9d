"""All sinks of a session, as one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from dynakin.errors import DynakinError
from dynakin.stream.sinks.base import LiveFrame, Sink, Started, Status
from dynakin.stream.sources.packets import Packet, StreamInfo


class SinkGroup(Sink):
    """Passes on what happens, without those sinks that fail, and begins a recording when a sink asks for one.

    Args:
        record: makes a recorder; None: nobody can ask for one. say: tells the user.

    Attributes:
        failures: why those that failed did.
    """

    def __init__(self, sinks: Sequence[Sink], record: Callable[[], Sink] | None, say: Callable[[str], None]) -> None:
        self._sinks, self._record, self._say = list(sinks), record, say
        self._recording: Sink | None = None
        self._before: list[Callable[[Sink], None]] = []  # what one that comes later is told first
        self.failures: list[str] = []

    def append(self, sink: Sink) -> None:
        """One more, which is told how the session began."""
        for tell in self._before:
            tell(sink)
        self._sinks.append(sink)

    def begins(self, subject: Mapping[str, float], delay_s: float) -> None:
        """Hand it on."""
        self._tell_all(lambda sink: sink.begins(subject, delay_s))

    def opened(self, markers: StreamInfo, plates: StreamInfo | None) -> None:
        """Hand it on."""
        self._tell_all(lambda sink: sink.opened(markers, plates))

    def _tell_all(self, tell: Callable[[Sink], None]) -> None:
        self._before.append(tell)
        for sink in self._sinks:
            tell(sink)

    def packet(self, packet: Packet) -> None:
        """Hand it on."""
        for sink in self._sinks:
            sink.packet(packet)

    def started(self, started: Started) -> None:
        """Hand it on."""
        for sink in self._sinks:
            sink.started(started)

    def frame(self, frame: LiveFrame) -> None:
        """Hand it on."""
        for sink in self._sinks:
            sink.frame(frame)

    def said(self, text: str, status: Status) -> None:
        """Hand it on."""
        for sink in self._sinks:
            sink.said(text, status)

    def asked(self) -> list[str]:
        """What is asked for beyond a recording, which begins or ends here."""
        self._drop_failed()
        wishes = [wish for sink in self._sinks for wish in sink.asked()]
        if "record" in wishes and self._record is not None:
            self._switch_recorder(self._record)
        return [wish for wish in wishes if wish != "record"]

    def close(self) -> None:
        """Close each."""
        for sink in self._sinks:
            sink.close()
        self._drop_failed()

    def _drop_failed(self) -> None:
        for sink in list(self._sinks):
            if (text := sink.failure()) is None:
                continue
            self._sinks.remove(sink)
            if sink is self._recording:
                self._recording = None
            sink.close()
            self.failures.append(text)
            self._say(text)

    def _switch_recorder(self, record: Callable[[], Sink]) -> None:
        """Begin to record, or end it."""
        if self._recording is not None:
            self._recording.close()
            self._drop_failed()
            if self._recording is not None:
                self._sinks.remove(self._recording)
                self._recording = None
                self._say("The recording has ended.")
            return
        try:
            self._recording = record()
        except DynakinError as error:
            self._say(error.message)
            return
        self.append(self._recording)
        self._say("Recording.")
