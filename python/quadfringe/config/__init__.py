"""Settings: frozen data with units in names. A key that is not known is an error."""

from quadfringe.config._base import SIZE_MAX, Finite, Model, NotNegative, Positive, checked
from quadfringe.config._brief import brief, shortened
from quadfringe.config._report import reason
from quadfringe.config.cameras import (
    AnyCapture,
    AravisConfig,
    ChipConfig,
    FilesConfig,
    ReplayConfig,
    UvcConfig,
    VirtualConfig,
    capture_config,
)
from quadfringe.config.decode import (
    ChannelResponse,
    DecodeConfig,
    Response,
    ResponseChoice,
    ResponseSetting,
    Row4,
)
from quadfringe.config.devices import IDENTITY, Camera, Device, Pixels, Triple
from quadfringe.config.fringes import Fringes
from quadfringe.config.projectors import FlashRoute, HdmiProjectorConfig, HdmiRoute, ProjectorConfig, ProjectorsConfig
from quadfringe.config.scene import Affine, BayerPattern, HeightMapConfig, Matrix4, SceneConfig, Surface
from quadfringe.config.system import SystemConfig, check_system, load_system

__all__ = [
    "IDENTITY",
    "SIZE_MAX",
    "Affine",
    "AnyCapture",
    "AravisConfig",
    "BayerPattern",
    "Camera",
    "ChannelResponse",
    "ChipConfig",
    "DecodeConfig",
    "Device",
    "FilesConfig",
    "Finite",
    "FlashRoute",
    "Fringes",
    "HdmiProjectorConfig",
    "HdmiRoute",
    "HeightMapConfig",
    "Matrix4",
    "Model",
    "NotNegative",
    "Pixels",
    "Positive",
    "ProjectorConfig",
    "ProjectorsConfig",
    "ReplayConfig",
    "Response",
    "ResponseChoice",
    "ResponseSetting",
    "Row4",
    "SceneConfig",
    "Surface",
    "SystemConfig",
    "Triple",
    "UvcConfig",
    "VirtualConfig",
    "brief",
    "capture_config",
    "check_system",
    "checked",
    "load_system",
    "reason",
    "shortened",
]
