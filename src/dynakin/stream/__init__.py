"""Live use: sources, fusion by time stamp, the session with its guided start, and sinks."""

from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame, Sink
from dynakin.stream.sources.packets import MarkerPacket, Packet, PlatePacket, StreamInfo, Streams
from dynakin.stream.sources.replay import Replay

__all__ = [
    "Callback",
    "Live",
    "LiveFrame",
    "MarkerPacket",
    "Packet",
    "PlatePacket",
    "Replay",
    "Sink",
    "StreamInfo",
    "Streams",
]
