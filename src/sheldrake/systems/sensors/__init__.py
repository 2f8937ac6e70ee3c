"""Sensors: encoders, inertial sensors, cameras, and their images."""

from sheldrake.common._names import show_as_own
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

from ._apply_camera_config import ApplyCameraConfig
from ._camera_config import CameraConfig
from ._image_io import ImageFileFormat, ImageIo
from ._image_writer import ImageWriter
from ._inertial import Accelerometer, Accelerometer_, Gyroscope, Gyroscope_
from ._lcm_images import ImageToLcmImageArrayT, LcmImageArrayToImages
from ._rgbd_sensor import RgbdSensor, RgbdSensorDiscrete
from ._rgbd_sensor_async import RgbdSensorAsync
from ._rotary_encoders import RotaryEncoders, RotaryEncoders_

__all__ = [
    "Accelerometer",
    "Accelerometer_",
    "ApplyCameraConfig",
    "CameraConfig",
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
    "ImageFileFormat",
    "ImageGrey8U",
    "ImageIo",
    "ImageLabel16I",
    "ImageRgb8U",
    "ImageRgba8U",
    "ImageToLcmImageArrayT",
    "ImageTraits",
    "ImageWriter",
    "LcmImageArrayToImages",
    "PixelFormat",
    "PixelScalar",
    "PixelType",
    "RgbdSensor",
    "RgbdSensorAsync",
    "RgbdSensorDiscrete",
    "RotaryEncoders",
    "RotaryEncoders_",
]

show_as_own(globals())
