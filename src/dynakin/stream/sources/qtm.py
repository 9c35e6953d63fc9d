"""`qtm:HOST`: markers and force plates of Qualisys Track Manager, over its real-time protocol."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from typing import Any

import numpy as np
import qtm_rt

from dynakin.errors import ConfigError, StreamError
from dynakin.recordings.times import step_of
from dynakin.stream.sources.packets import MarkerPacket, Packet, PlatePacket, StreamInfo, Streams
from dynakin.stream.sources.qtm_parameters import FRAMES, QtmParameters, parse_parameters

_PORT = 22223  # the base port's little-endian one
_VERSION = "1.18"  # servers speak every older version too
_FIRST_FRAMES = 20
_SAME_CLOCK_S = 0.25  # markers and plates that are further apart count time from different moments


class QtmSource:
    """One QTM, its markers (3D) and plates (force).

    Markers carry QTM's stamps. Samples of plates are counted, not stamped: their count over their rate is their time.
    Where that is not near the markers' stamps, the offset is found from arrivals.

    Args:
        host: address of the computer that runs QTM. port: its little-endian port.
        frame: "plate" or "lab", as QTM's project options (force data) have it.
    """

    def __init__(self, host: str, *, port: int = _PORT, frame: str = "plate") -> None:
        self.host, self.port, self.frame = host, port, frame
        self._loop: asyncio.AbstractEventLoop | None = None
        self._connection: Any = None
        self._parameters: QtmParameters | None = None
        self._packets: deque[Packet] = deque()
        self._came: asyncio.Event | None = None
        self._lost = False

    def open(self, timeout_s: float) -> Streams:
        """Connect, ask for labels and plates, and begin to stream.

        Raises:
            StreamError: nobody answers, or no frames come. ConfigError: no labels, or plates at several rates.
        """
        self.close()
        loop = self._loop = asyncio.new_event_loop()
        self._packets.clear()
        self._lost = False
        return loop.run_until_complete(self._connect(time.monotonic() + timeout_s, timeout_s))

    def read(self, timeout_s: float) -> list[Packet] | None:
        """What came.

        Raises:
            StreamError: QTM closed the connection.
        """
        assert self._loop is not None
        self._loop.run_until_complete(self._wait(timeout_s))
        found = list(self._packets)
        self._packets.clear()
        if self._lost and not found:
            raise StreamError(f"{self._where}: QTM closed the connection")
        return found

    def close(self) -> None:
        """Let go of the connection."""
        if self._loop is None:
            return
        if self._connection is not None and self._connection.has_transport():
            self._connection.disconnect()
            self._loop.run_until_complete(asyncio.sleep(0.0))
        self._connection = None
        self._loop.close()
        self._loop = None

    @property
    def _where(self) -> str:
        return f"qtm:{self.host}"

    async def _connect(self, deadline: float, timeout_s: float) -> Streams:
        self._came = asyncio.Event()
        while self._connection is None:
            try:
                async with asyncio.timeout(max(deadline - time.monotonic(), 0.1)):
                    self._connection = await qtm_rt.connect(
                        self.host, self.port, version=_VERSION, on_disconnect=self._on_disconnect
                    )
                    if self._connection is None:
                        await asyncio.sleep(0.2)
            except TimeoutError:
                raise StreamError(
                    f"{self._where}: no QTM answers at port {self.port} within {timeout_s:g} s; expected one whose "
                    "real-time output is on"
                ) from None
        try:
            text = await self._connection.get_parameters(["general", "3d", "force"])
            self._parameters = parse_parameters(text, self._where)
            parts = ["3d", "force"] if self._parameters.plates else ["3d"]
            await self._connection.stream_frames("allframes", parts, self._on_packet)
        except (qtm_rt.QRTCommandException, TimeoutError) as error:
            raise StreamError(f"{self._where}: QTM refused to stream ({error})") from None
        while not self._described() and time.monotonic() < deadline and not self._lost:
            await asyncio.sleep(0.02)
        return self._streams(timeout_s)

    def _described(self) -> bool:
        assert self._parameters is not None
        frames = sum(isinstance(packet, MarkerPacket) for packet in self._packets)
        plates = any(isinstance(packet, PlatePacket) for packet in self._packets)
        return frames >= _FIRST_FRAMES and (plates or not self._parameters.plates or frames >= 5 * _FIRST_FRAMES)

    def _streams(self, timeout_s: float) -> Streams:
        parameters = self._parameters
        assert parameters is not None
        stamps = np.array([packet.time_s for packet in self._packets if isinstance(packet, MarkerPacket)])
        if len(stamps) < 2:
            raise StreamError(
                f"{self._where}: QTM answers, but no frames come within {timeout_s:g} s; start a measurement or play "
                "a file with real-time output"
            )
        rate = 1.0 / step_of(stamps)
        notes = [f"{self._where}: {len(parameters.labels)} labels, up is {parameters.up or 'not given'}."]
        markers = StreamInfo(parameters.labels, rate, "qtm", ordered=True)
        if not parameters.plates:
            return Streams(markers, None, tuple(notes))
        counted = [packet.time_s[-1] for packet in self._packets if isinstance(packet, PlatePacket)]
        same = bool(counted) and abs(counted[-1] - stamps[-1]) < _SAME_CLOCK_S
        if not same:
            notes.append(f"{self._where}: plates count time from another moment; it is found from arrivals.")
        notes.append(f"{self._where}: forces are taken to be in the frame of the {self.frame} (forces=plate or lab).")
        names = tuple(plate.name for plate in parameters.plates)
        plates = StreamInfo(names, parameters.plates[0].rate_hz, "qtm" if same else "qtm-plates", ordered=True)
        return Streams(markers, plates, tuple(notes))

    async def _wait(self, timeout_s: float) -> None:
        assert self._came is not None
        if not self._packets and not self._lost:
            self._came.clear()
            try:
                await asyncio.wait_for(self._came.wait(), timeout_s)
            except TimeoutError:
                return

    def _on_disconnect(self, _: object) -> None:
        self._lost = True
        if self._came is not None:
            self._came.set()

    def _on_packet(self, packet: Any) -> None:
        now = time.monotonic()
        parameters = self._parameters
        if parameters is None or self._came is None:
            return
        forces = packet.get_force()
        if forces is not None:
            found = self._plate_packet(forces[1], now)
            if found is not None:
                self._packets.append(found)
        markers = packet.get_3d_markers()
        if markers is not None and len(markers[1]) == len(parameters.labels):
            positions = np.array(markers[1], float).reshape(-1, 3) / 1000.0
            self._packets.append(MarkerPacket(packet.timestamp * 1e-6, positions, now))
        self._came.set()

    def _plate_packet(self, forces: list[Any], now: float) -> PlatePacket | None:
        """Samples of all plates; where they are not of the same moments, NaN takes the missing one's place."""
        assert self._parameters is not None
        plates = self._parameters.plates
        ends = [(head.force_number, head.force_number + len(rows)) for head, rows in forces if rows]
        if not ends:
            return None
        first, end = min(begin for begin, _ in ends), max(end for _, end in ends)
        wrenches = np.full((end - first, len(plates), 6), np.nan)
        numbers = [plate.number for plate in plates]
        for head, rows in forces:
            if head.id in numbers and rows:
                k = numbers.index(head.id)
                begin = head.force_number - first
                wrenches[begin : begin + len(rows), k] = plates[k].wrenches(np.array(rows, float), self.frame)
        return PlatePacket(np.arange(first, end) / plates[0].rate_hz, wrenches, now)


def qtm_source(address: str, options: dict[str, str]) -> QtmSource:
    """`qtm:HOST[,port=22223][,forces=plate|lab]`.

    Raises:
        ConfigError: no host, another option, or a value that is none of those.
    """
    frame = options.get("forces", "plate")
    port = options.get("port", str(_PORT))
    if (
        not address
        or set(options) - {"port", "forces"}
        or frame not in FRAMES
        or not (port.isdecimal() and 0 < int(port) < 65536)
    ):
        raise ConfigError(
            f"qtm:{address}: expected qtm:HOST[,port=22223][,forces=plate|lab], ports 1 to 65535, found {options}"
        )
    return QtmSource(address, port=int(port), frame=frame)
