"""From a shot to a shape: the kernel's decoder planned once, the verdict on its result, and the stages one by one."""

from quadfringe.decoding.decoder import Decoder, decode
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.reference import StepSettings, decode_steps
from quadfringe.decoding.response import estimate_response
from quadfringe.decoding.step_files import read_steps

__all__ = ["Decoder", "Plan", "StepSettings", "decode", "decode_steps", "estimate_response", "read_steps"]
