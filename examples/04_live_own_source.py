"""A capture system of your own as a live source: what a vendor's SDK gives, handed on as packets.

`Vendor` stands for the SDK's client; put the real one in its place. Made known as an entry point in your package's
pyproject.toml, the command line finds it too (`dynakin live --source mylab:192.168.0.5`):

    [project.entry-points."dynakin.sources"]
    mylab = "my_package:mylab_source"
"""

import time

import numpy as np

import dynakin
from dynakin.errors import StreamError
from dynakin.simulation import simulate_squat
from dynakin.stream import Callback, Live, LiveFrame, MarkerPacket, Packet, PlatePacket, StreamInfo, Streams


class Vendor:
    """A client as vendors make them: frames in millimetres, one call a frame, twice the real pace here."""

    def __init__(self, address: str) -> None:
        self.address, self.trial, self.next = address, simulate_squat(seed=1, duration_s=5.0).recording, 0

    def frame(self) -> dict | None:
        time.sleep(0.005)
        k, self.next = self.next, self.next + 1
        if k >= self.trial.n_frames:
            return None
        loads = [np.hstack([plate.force[k], plate.moment[k]]) for plate in self.trial.plates]
        return {"number": k, "points_mm": 1000.0 * self.trial.markers[k], "loads": loads}


class MyLab:
    """The source: open, read and close. It lives in a thread of its own and is opened again after a StreamError."""

    def __init__(self, address: str) -> None:
        self.address, self.client = address, None

    def open(self, timeout_s: float) -> Streams:
        try:
            self.client = Vendor(self.address)
        except OSError as error:
            raise StreamError(f"mylab:{self.address}: nobody answers within {timeout_s:g} s ({error})") from None
        trial = self.client.trial
        plates = tuple(plate.name for plate in trial.plates)
        return Streams(StreamInfo(trial.marker_names, 100.0, "mylab"), StreamInfo(plates, 100.0, "mylab"))

    def read(self, timeout_s: float) -> list[Packet] | None:
        frame = self.client.frame()
        if frame is None:
            return None  # it is over
        stamp = frame["number"] / 100.0
        plates = PlatePacket(np.array([stamp]), np.array(frame["loads"])[None])  # ground on person, N and N m
        return [plates, MarkerPacket(stamp, frame["points_mm"] / 1000.0)]  # metres; NaN where a marker is missing

    def close(self) -> None:
        self.client = None


def mylab_source(address: str, options: dict[str, str]) -> MyLab:
    """What the entry point names: `mylab:ADDRESS[,key=value]`."""
    return MyLab(address)


def show(frame: LiveFrame) -> None:
    late = frame.published  # 50 ms late, from the frames until then; None of the first frames
    if late is not None and round(late.time_s * 100) % 50 == 0:
        knee = np.rad2deg(late.coordinates["knee"])
        print(f"{late.time_s:5.2f} s  knee {knee:6.1f} deg  moment {late.moments['knee']:7.1f} N m")


if __name__ == "__main__":
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    model = dynakin.load_model("sagittal7", subject=subject, markers="opencap")
    Live(dynakin.Estimator(model), [mylab_source("192.168.0.5", {})], [Callback(show)]).run()
