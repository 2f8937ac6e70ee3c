"""Sensors: encoders, inertial sensors, and the images and cameras of others."""

from sheldrake.geometry._camera_info import CameraInfo
from sheldrake.geometry._image import (
    ConvertDepth16UTo32F,
    ConvertDepth32FTo16U,
    Image,
    ImageBgr8U,
    ImageBgra8U,
    ImageDepth16U,
    ImageDepth32F,
    ImageGrey8U,
    ImageLabel16I,
    ImageRgb8U,
    ImageRgba8U,
    ImageTraits,
    PixelFormat,
    PixelScalar,
    PixelType,
)

from ._inertial import Accelerometer, Accelerometer_, Gyroscope, Gyroscope_
from ._rotary_encoders import RotaryEncoders, RotaryEncoders_

__all__ = [
    "Accelerometer",
    "Accelerometer_",
    "CameraInfo",
    "ConvertDepth16UTo32F",
    "ConvertDepth32FTo16U",
    "Gyroscope",
    "Gyroscope_",
    "Image",
    "ImageBgr8U",
    "ImageBgra8U",
    "ImageDepth16U",
    "ImageDepth32F",
    "ImageGrey8U",
    "ImageLabel16I",
    "ImageRgb8U",
    "ImageRgba8U",
    "ImageTraits",
    "PixelFormat",
    "PixelScalar",
    "PixelType",
    "RotaryEncoders",
    "RotaryEncoders_",
]
