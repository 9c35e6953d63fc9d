"""Live use: sources, fusion by time stamp, the session with its guided start, and sinks."""

from dynakin.stream.fusion import Fused, Fusion
from dynakin.stream.packets import MarkerPacket, Packet, PlatePacket, Source, StreamInfo, Streams
from dynakin.stream.plugins import SINKS, SOURCES, plugin
from dynakin.stream.replay import Replay
from dynakin.stream.session import Live
from dynakin.stream.sinks import Callback, LiveFrame, Sink, Started, Status

__all__ = [
    "SINKS",
    "SOURCES",
    "Callback",
    "Fused",
    "Fusion",
    "Live",
    "LiveFrame",
    "MarkerPacket",
    "Packet",
    "PlatePacket",
    "Replay",
    "Sink",
    "Source",
    "Started",
    "Status",
    "StreamInfo",
    "Streams",
    "plugin",
]
