"""Sources in threads of their own: packets in one queue, connections that are lost are made again."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from dynakin.errors import ConfigError, DynakinError, StreamError
from dynakin.stream.sources.packets import Packet, Seam, Source, Streams

_READ_S = 0.02
_AGAIN_S = 0.5


@dataclass(frozen=True)
class Notice:
    """Something that happened to a source, to be said."""

    text: str
    fatal: DynakinError | None = None


class Reader:
    """Reads several sources at once.

    Args:
        sources: one with markers; plates from the same or another one.
        wait_s: how long ``open`` waits for the first connection.
    """

    def __init__(self, sources: Sequence[Source], wait_s: float = 30.0) -> None:
        self.sources, self.wait_s = tuple(sources), wait_s
        self._queue: queue.SimpleQueue[Packet | Seam | Notice | None] = queue.SimpleQueue()
        self._stop = threading.Event()
        self._threads: list[threading.Thread] = []
        self._open = 0

    def open(self) -> Streams:
        """Connect to all; gives their streams together.

        Raises:
            StreamError: a source that cannot be reached in time, or two sources of the same kind.
        """
        described: list[Streams] = []
        for source in self.sources:
            described.append(source.open(self.wait_s))
        markers = [streams.markers for streams in described if streams.markers]
        plates = [streams.plates for streams in described if streams.plates]
        if len(self.sources) > 1 and len(plates) > 1 and described[-1].plates and not described[-1].markers:
            # A second source given for its plates takes the place of those that come with the markers.
            described = [replace(streams, plates=None) for streams in described[:-1]] + [described[-1]]
            plates = plates[-1:]
        for kind, found in (("markers", markers), ("plates", plates)):
            if len(found) > 1:
                raise StreamError(f"{len(found)} sources give {kind}, expected one")
        for source, streams in zip(self.sources, described, strict=True):
            thread = threading.Thread(target=self._run, args=(source, streams), daemon=True)
            self._threads.append(thread)
        self._open = len(self._threads)
        for thread in self._threads:
            thread.start()
        notes = tuple(note for streams in described for note in streams.notes)
        subject = {key: value for streams in described for key, value in streams.subject.items()}
        return Streams(
            markers[0] if markers else None,
            plates[0] if plates else None,
            notes,
            subject,
            all(streams.paced for streams in described),
            min(streams.length_s for streams in described),
        )

    def get(self, timeout_s: float) -> Packet | Seam | Notice | None:
        """The next packet or notice, None where nothing came in time."""
        try:
            found = self._queue.get(timeout=timeout_s)
        except queue.Empty:
            return None
        if found is None:
            self._open -= 1
        return found

    @property
    def backlog(self) -> int:
        """Packets that wait."""
        return self._queue.qsize()

    @property
    def over(self) -> bool:
        """Whether all sources have ended and everything was taken."""
        return self._open == 0 and self._queue.empty()

    def close(self) -> None:
        """Stop the threads and close the sources."""
        self._stop.set()
        for thread in self._threads:
            thread.join(2.0)
        for source in self.sources:
            source.close()

    def _run(self, source: Source, streams: Streams) -> None:
        opened = True
        while not self._stop.is_set():
            try:
                if not opened:
                    again = source.open(_AGAIN_S)
                    opened = True
                    self._check_same(streams, again)
                    self._queue.put(Notice("The source is back."))
                packets = source.read(_READ_S)
            except StreamError as error:
                if opened:
                    self._queue.put(Notice(f"The source is lost ({error.message}); it is looked for again."))
                    source.close()
                opened = False
                self._stop.wait(_AGAIN_S)
                continue
            except DynakinError as error:
                self._queue.put(Notice(error.message, error))
                break
            except Exception as error:  # a plug-in's own fault must not end in silence
                said = f"{type(source).__name__} failed: {type(error).__name__}: {error}"
                self._queue.put(Notice(said, StreamError(said)))
                break
            if packets is None:
                break
            now = time.monotonic()
            for packet in packets:
                wanted = streams.plates if hasattr(packet, "wrenches") else streams.markers
                if wanted is not None:
                    self._queue.put(packet if packet.arrived_s == packet.arrived_s else replace(packet, arrived_s=now))
        self._queue.put(None)

    @staticmethod
    def _check_same(before: Streams, now: Streams) -> None:
        """
        Raises:
            ConfigError: the source came back with other markers or plates.
        """
        for kind in ("markers", "plates"):
            old, new = getattr(before, kind), getattr(now, kind)
            if old is not None and (new is None or new.names != old.names):
                raise ConfigError(
                    f"the source came back with other {kind}: {', '.join(new.names) if new else 'none'}; expected "
                    f"{', '.join(old.names)} (start again)"
                )
