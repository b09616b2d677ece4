"""A bench without hardware: a camera and two projectors in front of a simulated scene."""

from quadfringe.devices.virtual._bench import PrintedBoard, VirtualBench
from quadfringe.devices.virtual._devices import VirtualCamera, VirtualProjector, open_devices

__all__ = ["PrintedBoard", "VirtualBench", "VirtualCamera", "VirtualProjector", "open_devices"]
