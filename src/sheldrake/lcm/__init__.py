"""Messages by channel (LCM): in memory and on the network."""

from sheldrake.lcm._interface import DrakeLcm, DrakeLcmInterface, DrakeLcmParams, Subscriber

__all__ = ["DrakeLcm", "DrakeLcmInterface", "DrakeLcmParams", "Subscriber"]

for _name in __all__:
    globals()[_name].__module__ = __name__
