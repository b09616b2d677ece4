"""From a shot to a shape: the kernel's decoder planned once, the verdict on its result, and the stages one by one."""

from quadfringe.decoding.decoder import Decoder, decode
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.response import estimate_response

__all__ = ["Decoder", "Plan", "decode", "estimate_response"]
