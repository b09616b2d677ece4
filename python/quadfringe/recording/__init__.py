"""Takes: raw shots on disk, crash-safe, and back."""

from quadfringe.recording.reader import Recording
from quadfringe.recording.recorder import Recorder, RecorderStatistics
from quadfringe.recording.recover import Recovered, recover
from quadfringe.recording.writer import RecordingWriter

__all__ = ["Recorder", "RecorderStatistics", "Recording", "RecordingWriter", "Recovered", "recover"]
