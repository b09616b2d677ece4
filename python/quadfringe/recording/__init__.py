"""Recordings: raw shots on disk that survive a crash; recorder, reader, replay, recovery and batch decoding."""

from quadfringe.recording.reader import Recording
from quadfringe.recording.recorder import Recorder, RecorderStatistics
from quadfringe.recording.recover import Recovered, recover
from quadfringe.recording.writer import RecordingWriter

__all__ = ["Recorder", "RecorderStatistics", "Recording", "RecordingWriter", "Recovered", "recover"]
