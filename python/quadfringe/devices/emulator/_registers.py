"""Registers of the emulated camera, and the GenICam file that describes them.

Addresses below 0x10000 follow the GigE Vision standard; the others belong to this camera.
"""

from __future__ import annotations

from typing import Final
from xml.sax.saxutils import escape

__all__ = ["EXPOSURE_STEP_US", "FEATURES", "PIXEL_FORMATS", "XML_ADDRESS", "genicam"]

EXPOSURE_STEP_US: Final = 42.07
XML_ADDRESS: Final = 0x100000
PACKETS_ADDRESS: Final = 0x0D04  # of stream channel 0; those of other channels follow
LARGEST_PACKET: Final = 9000
PIXEL_FORMATS: Final = {
    "Mono8": 0x01080001,
    "Mono10": 0x01100003,
    "Mono10Packed": 0x010C0004,
    "Mono10p": 0x010A0046,
    "Mono12": 0x01100005,
    "Mono12Packed": 0x010C0006,
    "Mono12p": 0x010C0047,
    "BayerRG8": 0x01080009,
    "BayerRG10": 0x0110000D,
    "BayerRG10Packed": 0x010C0027,
    "BayerRG10p": 0x010A0058,
    "BayerRG12": 0x01100011,
    "BayerRG12Packed": 0x010C002B,
    "BayerRG12p": 0x010C0059,
    "BayerGR8": 0x01080008,
    "BayerGR10": 0x0110000C,
    "BayerGR10Packed": 0x010C0026,
    "BayerGR10p": 0x010A0056,
    "BayerGR12": 0x01100010,
    "BayerGR12Packed": 0x010C002A,
    "BayerGR12p": 0x010C0057,
    "BayerGB8": 0x0108000A,
    "BayerGB10": 0x0110000E,
    "BayerGB10Packed": 0x010C0028,
    "BayerGB10p": 0x010A0054,
    "BayerGB12": 0x01100012,
    "BayerGB12Packed": 0x010C002C,
    "BayerGB12p": 0x010C0055,
    "BayerBG8": 0x0108000B,
    "BayerBG10": 0x0110000F,
    "BayerBG10Packed": 0x010C0029,
    "BayerBG10p": 0x010A0052,
    "BayerBG12": 0x01100013,
    "BayerBG12Packed": 0x010C002D,
    "BayerBG12p": 0x010C0053,
    "RGB8": 0x02180014,
}
FEATURES: Final = {
    "Width": 0x20000,
    "Height": 0x20004,
    "Acquisition": 0x2000C,
    "FramePeriodUs": 0x20010,
    "TriggerMode": 0x20014,
    "TriggerSource": 0x20018,
    "SoftwareTrigger0": 0x2001C,
    "ExposureTimeRaw": 0x20020,
    "GainRaw": 0x20024,
    "SyncMode": 0x20028,
    "SensorWidth": 0x2002C,
    "SensorHeight": 0x20030,
    "SourceSelector": 0x20034,
    "PixelFormat": 0x20100,  # one for each source
}


def _register(name: str, access: str = "RW", selector: str | None = None) -> str:
    index = "" if selector is None else f'<pIndex Offset="4">{selector}Reg</pIndex>'
    return (
        f'<IntReg Name="{name}Reg"><Address>{FEATURES[name]:#x}</Address>{index}<Length>4</Length><AccessMode>{access}'
        "</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable><Sign>Unsigned</Sign><Endianess>BigEndian"
        "</Endianess></IntReg>"
    )


def _integer(name: str, least: int, most: int | str, step: int = 1, access: str = "RW") -> str:
    top = f"<pMax>{most}</pMax>" if isinstance(most, str) else f"<Max>{most}</Max>"
    return (
        f'<Integer Name="{name}"><pValue>{name}Reg</pValue><Min>{least}</Min>{top}<Inc>{step}</Inc></Integer>'
        + _register(name, access)
    )


def _enumeration(name: str, entries: dict[str, int], selector: str | None = None) -> str:
    listed = "".join(f'<EnumEntry Name="{key}"><Value>{value}</Value></EnumEntry>' for key, value in entries.items())
    return (
        f'<Enumeration Name="{name}">{listed}<pValue>{name}Reg</pValue></Enumeration>{_register(name, "RW", selector)}'
    )


def _choice(name: str, only: str) -> str:
    """Return an enumeration with a single entry."""
    entry = f'<EnumEntry Name="{only}"><Value>0</Value></EnumEntry>'
    return f'<Enumeration Name="{name}">{entry}<Value>0</Value></Enumeration>'


def _command(name: str, register: str, value: int) -> str:
    return f'<Command Name="{name}"><pValue>{register}Reg</pValue><CommandValue>{value}</CommandValue></Command>'


def _text(name: str, address: int, length: int) -> str:
    return (
        f'<StringReg Name="{name}"><Address>{address:#x}</Address><Length>{length}</Length><AccessMode>RO</AccessMode>'
        "<pPort>Device</pPort></StringReg>"
    )


def _float(name: str, register: str, to_register: str, from_register: str, least: float, most: float) -> str:
    return (
        f'<Converter Name="{name}Conv"><FormulaTo>{escape(to_register)}</FormulaTo><FormulaFrom>{escape(from_register)}'
        f"</FormulaFrom><pValue>{register}</pValue></Converter>"
        f'<Float Name="{name}"><pValue>{name}Conv</pValue><Min>{least}</Min><Max>{most}</Max></Float>'
    )


def _nodes(formats: list[str], sources: int) -> dict[str, str]:
    """Return the nodes of every feature, by the name of the feature."""
    return (
        _identity_nodes() | _packet_nodes() | _image_nodes(formats, sources) | _acquisition_nodes() | _exposure_nodes()
    )


def _identity_nodes() -> dict[str, str]:
    return {
        "DeviceVendorName": _text("DeviceVendorName", 0x48, 32),
        "DeviceModelName": _text("DeviceModelName", 0x68, 32),
        "DeviceID": _text("DeviceID", 0xD8, 16),
    }


def _image_nodes(formats: list[str], sources: int) -> dict[str, str]:
    selector = "SourceSelector" if sources > 1 else None
    choice = {} if selector is None else {selector: _enumeration(selector, {f"Source{n}": n for n in range(sources)})}
    known = {name: PIXEL_FORMATS[name] for name in formats}
    payload = "<Formula>(W * H * ((P &gt;&gt; 16) &amp; 0xFF) + 7) / 8</Formula>"
    variables = "".join(
        f'<pVariable Name="{short}">{name}</pVariable>'
        for short, name in (("W", "Width"), ("H", "Height"), ("P", "PixelFormat"))
    )
    return choice | {
        "SensorWidth": _integer("SensorWidth", 0, 65536, access="RO"),
        "SensorHeight": _integer("SensorHeight", 0, 65536, access="RO"),
        "Width": _integer("Width", 8, "SensorWidth", 8),
        "Height": _integer("Height", 8, "SensorHeight"),
        "PixelFormat": _enumeration("PixelFormat", known, selector),
        "PayloadSize": f'<IntSwissKnife Name="PayloadSize">{variables}{payload}</IntSwissKnife>',
    }


def _packet_nodes() -> dict[str, str]:
    """Return the nodes of test packets, with which a host finds the largest packet that the network carries."""
    return {
        "GevSCPSPacketSize": f'<Integer Name="GevSCPSPacketSize"><pValue>GevSCPSPacketSizeReg</pValue><Min>576</Min>'
        f"<Max>{LARGEST_PACKET}</Max><Inc>4</Inc></Integer>" + _packet_register("GevSCPSPacketSize", 31, 16),
        "GevSCPSFireTestPacket": _command("GevSCPSFireTestPacket", "GevSCPSFireTestPacket", 1)
        + _packet_register("GevSCPSFireTestPacket", 0, 0),
    }


def _packet_register(name: str, lsb: int, msb: int) -> str:
    return (
        f'<MaskedIntReg Name="{name}Reg"><Address>{PACKETS_ADDRESS:#x}</Address><Length>4</Length><AccessMode>RW'
        f"</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable><LSB>{lsb}</LSB><MSB>{msb}</MSB>"
        "<Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></MaskedIntReg>"
    )


def _acquisition_nodes() -> dict[str, str]:
    return {
        "AcquisitionMode": _choice("AcquisitionMode", "Continuous"),
        "AcquisitionStart": _command("AcquisitionStart", "Acquisition", 1) + _register("Acquisition"),
        "AcquisitionStop": _command("AcquisitionStop", "Acquisition", 0),
        "AcquisitionFrameRate": _float(
            "AcquisitionFrameRate", "FramePeriodUs", "1000000 / FROM", "1000000 / TO", 0.1, 1e4
        )
        + _integer("FramePeriodUs", 100, 10_000_000),
        "TriggerSelector": _choice("TriggerSelector", "FrameStart"),
        "TriggerMode": _enumeration("TriggerMode", {"Off": 0, "On": 1}),
        "TriggerSource": _enumeration("TriggerSource", {"Line5": 0, "Software": 1, "PulseGenerator0": 2}),
        "SoftwareTrigger0": _command("SoftwareTrigger0", "SoftwareTrigger0", 1) + _register("SoftwareTrigger0"),
        "SyncMode": _enumeration("SyncMode", {"Sync": 0, "Async": 1}),
    }


def _exposure_nodes() -> dict[str, str]:
    return {
        "ExposureTimeRaw": _integer("ExposureTimeRaw", 0, 792),
        "ExposureTimeAbs": _float(
            "ExposureTimeAbs",
            "ExposureTimeRaw",
            f"(FROM - 20) / {EXPOSURE_STEP_US}",
            f"20 + TO * {EXPOSURE_STEP_US}",
            20,
            33340,
        ),
        "GainRaw": _integer("GainRaw", 0, 400),
    }


def genicam(formats: list[str], sources: int = 1) -> bytes:
    """Return the GenICam file of one device with these pixel formats and number of sources."""
    nodes = _nodes(formats, sources)
    root = "".join(f"<pFeature>{name}</pFeature>" for name in nodes)
    head = (
        '<RegisterDescription ModelName="Emulated" VendorName="quadfringe" StandardNameSpace="GEV" '
        'SchemaMajorVersion="1" SchemaMinorVersion="1" SchemaSubMinorVersion="0" '
        'MajorVersion="1" MinorVersion="0" SubMinorVersion="0" ToolTip="" ProductGuid="0" VersionGuid="0" xmlns="http://www.genicam.org/GenApi/Version_1_0">'
    )
    locked = '<Integer Name="TLParamsLocked"><Value>0</Value><Min>0</Min><Max>1</Max></Integer>'
    return (
        f'<?xml version="1.0" encoding="utf-8"?>\n{head}<Category Name="Root">{root}</Category>\n'
        + "\n".join(nodes.values())
        + f'\n{locked}<Port Name="Device"></Port></RegisterDescription>\n'
    ).encode()
