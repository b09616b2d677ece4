r"""Settings: frozen data with units in names. A key that is not known is an error.

>>> from quadfringe.config import *
>>> system = SystemConfig(
...     capture=AravisConfig(device="AD-080GE", visible=ChipConfig(pixel_format="BayerRG12p"), trigger="Line5"),
...     projectors=ProjectorsConfig(
...         visible=ProjectorConfig(port="1-1", hdmi=HdmiRoute(output="HDMI-1")),
...         infrared=ProjectorConfig(port="1-2", flash=FlashRoute(image=0, fringes=Fringes())),
...     ),
...     decode=DecodeConfig(response=Response(red=ChannelResponse(exponent=0.45))),
... )
>>> check_system(system)  # raises InputError for anything else
>>> system.capture.trigger, system.fringes.numbers, system.decode.response.red.exponent
('Line5', (36.0, 35.0, 30.0), 0.45)
>>> [capture_config(word).kind for word in ("uvc:0", "files:images", "replay:take.h5")]
['uvc', 'files', 'replay']
>>> isinstance(UvcConfig(gain=2.0), Model), FilesConfig(folder="images").settle_s, ReplayConfig(file="a.h5").speed
(True, 0.2, 'original')
>>> HdmiProjectorConfig(size_px=(1280, 720), output="HDMI-1").settle_s
0.2
>>> SceneConfig(height_map=HeightMapConfig(file="relief.npy", pitch_mm=(1, 1), origin_mm=(0, 0))).height_map.z_mm
800.0
>>> Device(width_px=8, height_px=6, focal_px=(20, 20), centre_px=(3.5, 2.5)).rotation == IDENTITY
True

A file, and a wrong entry in it:

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> with TemporaryDirectory() as folder:
...     _ = Path(folder, "system.toml").write_text('[scene]\nsurface = "steps"\nnoise = 0.03')
...     load_system(folder).scene
SceneConfig(surface='steps', noise=0.03)
>>> from quadfringe.errors import ConfigError
>>> try:
...     checked(SceneConfig, {"surfce": "steps"}, "system.toml")
... except ConfigError as error:
...     print(error)
system.toml: 1 problem
  surfce: this key is not known; did you mean surface?

The types of the settings serve models of other programs:

>>> class Lens(Model):
...     focal_mm: Positive
...     shift_mm: NotNegative = 0.0
...     tilt_deg: Finite = 0.0
...     size_px: tuple[Pixels, Pixels] = (1024, SIZE_MAX)
...     axis: Triple = (0.0, 0.0, 1.0)
...     gains: Row4 = (1.0, 1.0, 1.0, 1.0)
...     crosstalk: Matrix4 | None = None
...     registration: Affine | None = None
...     mosaic: BayerPattern = "rggb"
...     surface: Surface = "plane"
...     capture: AnyCapture = VirtualConfig()
...     response: ResponseSetting = "auto"
...     chosen: ResponseChoice = "linear"
...     camera: Camera | None = None
>>> Lens(focal_mm=16)
Lens(focal_mm=16)
>>> try:
...     Lens.__pydantic_validator__.validate_python({"focal_mm": -1})
... except ValueError as error:
...     print(reason(error.errors()[0]))
expected a number above 0, got -1
>>> brief(1 / 3), shortened("two\nlines")
('0.333333', 'two lines')
"""

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
