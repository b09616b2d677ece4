"""A projector, a camera and a decoder that belong together: single shots and streams."""

from quadfringe.scanner.scanner import Scanner, open_system
from quadfringe.scanner.streaming import LiveStream, Measured, StreamStatistics, Tap

__all__ = ["LiveStream", "Measured", "Scanner", "StreamStatistics", "Tap", "open_system"]
