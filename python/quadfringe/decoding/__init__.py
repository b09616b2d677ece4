"""From a shot to a shape: the kernel's decoder planned once, the verdict on its result, and the stages one by one."""

from quadfringe.decoding.decoder import Plan, ShotDecoder, decode, kernel_decoder, own_response

__all__ = ["Plan", "ShotDecoder", "decode", "kernel_decoder", "own_response"]
