"""Messages by channel (LCM): in memory and on the network."""

from sheldrake.common._names import show_as_own
from sheldrake.lcm._interface import DrakeLcm, DrakeLcmInterface, DrakeLcmParams, Subscriber

__all__ = ["DrakeLcm", "DrakeLcmInterface", "DrakeLcmParams", "Subscriber"]

show_as_own(globals())
