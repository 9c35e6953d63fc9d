"""A QTM that plays a recording, to the published real-time protocol (packets are packed here, not by the client's
library): little-endian TCP; commands Version, GetParameters and StreamFrames."""

from __future__ import annotations

import socket
import struct
import threading
import time

import numpy as np

from dynakin.recordings.recording import Recording

MISSING = struct.pack("<I", 0xFFFFFFFF) * 3
ERROR, COMMAND, XML, DATA, NO_MORE_DATA = range(5)
UP = np.array([0.0, 1.0, 0.0])


class QtmServer:
    """Serves one client after the other.

    Args:
        recording: laboratory frame, Y up; its plates are interpolated to ``plate_hz``.
        speed: of playing. chunk: frames of markers after which the plates' samples are sent.
        frame: in which forces are given. plate_start: order number of the first sample of the plates.
        measuring: whether there is anything to stream. hang_up: frames after which the connection is cut, once.
    """

    def __init__(
        self,
        recording: Recording,
        *,
        speed: float = 2.0,
        plate_hz: float = 1000.0,
        chunk: int = 2,
        frame: str = "plate",
        plate_start: int = 0,
        measuring: bool = True,
        hang_up: int | None = None,
    ) -> None:
        self.recording, self.speed, self.plate_hz, self.chunk = recording, speed, plate_hz, chunk
        self.frame, self.plate_start, self.measuring, self.hang_up = frame, plate_start, measuring, hang_up
        self.commands: list[str] = []
        count = round((recording.time[-1] - recording.time[0]) * plate_hz) + 1
        self.plate_time = recording.time[0] + np.arange(count) / plate_hz
        self.corners = [place + np.array([0.0, 0.0, 0.3 * k]) for k, place in enumerate([corners()] * 2)]
        loads = [np.hstack([plate.force, plate.moment]) for plate in recording.plates]
        self.wrenches = np.stack(  # (T, P, 6) on the person, about the laboratory origin
            [np.stack([np.interp(self.plate_time, recording.time, c) for c in load.T], axis=1) for load in loads],
            axis=1,
        )
        self.rows = np.stack(
            [self._rows(self.wrenches[:, k], self.corners[k]) for k in range(len(loads))], axis=1
        ).astype("<f4")
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(0.1)
        self.port = int(self._listener.getsockname()[1])
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    @property
    def sent(self) -> np.ndarray:
        """Markers (T, M, 3) m as a client that takes float32 millimetres has them."""
        return (1000.0 * self.recording.markers).astype("<f4").astype(float) / 1000.0

    def close(self) -> None:
        self._stop.set()
        self._thread.join(5.0)
        self._listener.close()

    def _rows(self, wrench: np.ndarray, corners: np.ndarray) -> np.ndarray:
        """Force, moment and point of application (mm) on the plate, in the asked frame."""
        force, moment = -wrench[:, :3], -wrench[:, 3:]
        centre, axes = corners.mean(axis=0), plate_axes(corners)
        moment_c = moment - np.cross(centre, force)
        down = force @ axes[:, 2]
        reach = np.cross(axes[:, 2], moment_c) / np.where(np.abs(down) < 1.0, np.nan, down)[:, None]
        if self.frame == "lab":
            return np.hstack([force, moment, 1000.0 * (centre + reach)])
        return np.hstack([force @ axes, moment_c @ axes, 1000.0 * reach @ axes])

    def _serve(self) -> None:
        while not self._stop.is_set():
            try:
                client, _ = self._listener.accept()
            except TimeoutError:
                continue
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            client.settimeout(0.002)
            try:
                self._talk(client)
            except OSError:
                pass
            finally:
                client.close()

    def _talk(self, client: socket.socket) -> None:
        send(client, COMMAND, b"QTM RT Interface connected\0")
        pending = b""
        while not self._stop.is_set():
            try:
                data = client.recv(4096)
            except TimeoutError:
                continue
            if not data:
                return
            pending += data
            while len(pending) >= 8 and len(pending) >= (size := struct.unpack_from("<I", pending)[0]):
                command, pending = pending[8:size].rstrip(b"\0").decode(), pending[size:]
                self.commands.append(command)
                word, _, rest = command.lower().partition(" ")
                if word == "version":
                    send(client, COMMAND, f"Version set to {rest}".encode() + b"\0")
                elif word == "getparameters":
                    send(client, XML, self._xml().encode() + b"\0")
                elif command.lower().startswith("streamframes allframes") and self.measuring:
                    self._stream(client, "force" in command.lower())
                elif word == "streamframes":
                    send(client, NO_MORE_DATA, b"")
                else:
                    send(client, ERROR, b"Parse error\0")

    def _stream(self, client: socket.socket, with_force: bool) -> None:
        time_, row, begun = self.recording.time - self.recording.time[0], 0, time.monotonic()
        fine = self.plate_time - self.plate_time[0]
        for k, now in enumerate(time_):
            time.sleep(max(0.0, begun + now / self.speed - time.monotonic()))
            if self._stop.is_set():
                return
            if self.hang_up is not None and k >= self.hang_up:
                self.hang_up = None
                raise ConnectionError("cut")
            markers = (1000.0 * self.recording.markers[k]).astype("<f4")
            body = b"".join(MISSING if np.isnan(point).any() else point.tobytes() for point in markers)
            parts = [component(1, struct.pack("<Ihh", len(markers), 0, 0) + body)]
            if with_force and (k % self.chunk == self.chunk - 1 or k == len(time_) - 1):
                end = int(np.searchsorted(fine, now + 1e-9, side="right"))
                force = struct.pack("<i", self.rows.shape[1])
                for p in range(self.rows.shape[1]):
                    force += struct.pack("<iii", p + 1, end - row, self.plate_start + row)
                    force += self.rows[row:end, p].tobytes()
                parts.append(component(4, force))
                row = end
            send(client, DATA, struct.pack("<qII", round(now * 1e6), k + 1, len(parts)) + b"".join(parts))

    def _xml(self) -> str:
        labels = "".join(
            f"<Label><Name>{n}</Name><RGBColor>ff00ff</RGBColor></Label>" for n in self.recording.marker_names
        )
        plates = ""
        for k, corner in enumerate(self.corners[: len(self.recording.plates)]):
            place = "".join(f"<Corner{c}>{xyz(point)}</Corner{c}>" for c, point in enumerate(corner, 1))
            plates += (
                f"<Plate><Plate_ID>{k + 1}</Plate_ID><Frequency>{self.plate_hz:g}</Frequency><Type>AMTI</Type>"
                f"<Name>AMTI</Name><Location>{place}</Location></Plate>"
            )
        return (
            "<QTM_Parameters_Ver_1.18><General><Frequency>100</Frequency></General>"
            f"<The_3D><AxisUpwards>+Y</AxisUpwards><Labels>{len(self.recording.marker_names)}</Labels>{labels}</The_3D>"
            f"<Force><Unit_Length>mm</Unit_Length><Unit_Force>N</Unit_Force>{plates}</Force></QTM_Parameters_Ver_1.18>"
        )


def corners() -> np.ndarray:
    """Of a plate in a Y-up laboratory, listed so that x cross y points into the floor."""
    x, z = 0.3, 0.2
    return np.array([[x, 0.0, z], [-x, 0.0, z], [-x, 0.0, -z], [x, 0.0, -z]])


def plate_axes(corners: np.ndarray) -> np.ndarray:
    x, y = corners[0] - corners[1], corners[0] - corners[3]
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    axes = np.column_stack([x, y, np.cross(x, y)])
    assert axes[:, 2] @ UP < -0.99
    return axes


def xyz(point: np.ndarray) -> str:
    return "".join(f"<{axis}>{1000.0 * x:.3f}</{axis}>" for axis, x in zip("XYZ", point, strict=True))


def component(kind: int, body: bytes) -> bytes:
    return struct.pack("<II", 8 + len(body), kind) + body


def send(client: socket.socket, kind: int, body: bytes) -> None:
    client.settimeout(5.0)
    client.sendall(struct.pack("<II", 8 + len(body), kind) + body)
    client.settimeout(0.002)
