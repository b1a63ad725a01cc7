"""Which port is a source, in which format it comes, and how it is opened."""

from __future__ import annotations

from firmware_bridge.frames.decoder import frame_format
from firmware_bridge.frames.frame_format import FrameFormat
from firmware_bridge.sources.klipper import KlipperSource, klipper_chips
from firmware_bridge.sources.phyphox import PhyphoxSource
from firmware_bridge.sources.source import Source, sample_format
from firmware_bridge.sources.udp import UdpSource
from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError

__all__ = ["has_own_samples", "port_format", "source_of"]

_DEFAULT_FORMAT = "lpc1768"
_WITH_SAMPLES = {"klipper": "one_adxl345", "phyphox": "one_chip"}
"""Sources that deliver samples with times of their own, and the array if they have one chip."""


def has_own_samples(port: str) -> bool:
    """Whether a port delivers samples rather than frames: it has one format and can't be searched for a board."""
    return _scheme(port) in _WITH_SAMPLES


def port_format(port: str, form: str | FrameFormat = "", array: str = "") -> FrameFormat:
    """Return the format in which samples come from a port.

    Parameters
    ----------
    port : str
        Device or URL.
    form : str or FrameFormat
        The format asked for; the board of this project by default. `klipper://` and `phyphox://` have their own.
    array : str
        Array asked for; needed where a source has several chips, whose places it can't know.

    Raises
    ------
    InputError
        If the format is unknown, or a source can't have it or has other chips than the array.
    """
    scheme = _scheme(port)
    if scheme not in _WITH_SAMPLES:
        return frame_format(form or _DEFAULT_FORMAT)
    if isinstance(form, FrameFormat) and form.name == scheme:
        return form
    if form:
        raise InputError(f"{port}: --format is for frames, and {scheme} sends samples; leave it out")
    chips = len(klipper_chips(port)) or 1 if scheme == "klipper" else 1
    if chips > 1 and not array:
        raise InputError(f"{port}: say with --array where the {chips} chips are (gfimu new array), in the URL's order")
    found = sample_format(scheme, array or _WITH_SAMPLES[scheme])
    carried = AccelerometerArray.load(found.array)
    if [len(chip.axes) for chip in carried.chips] != [3] * chips:
        raise InputError(
            f"{port}: array {carried.name!r} has {len(carried.chips)} chips with {carried.n_channels} axes; "
            f"this source has {chips} with three axes each"
        )
    return found


def source_of(port: str, form: FrameFormat | None = None) -> Source | None:
    """Return the source behind a port, not yet opened; None for what pyserial opens."""
    scheme = _scheme(port)
    if scheme == "udp":
        return UdpSource(port, form)
    if scheme not in _WITH_SAMPLES:
        return None
    form = port_format(port) if form is None else form
    return KlipperSource(port, form) if scheme == "klipper" else PhyphoxSource(port, form)


def _scheme(port: str) -> str:
    return port.partition("://")[0].lower() if "://" in port else ""
