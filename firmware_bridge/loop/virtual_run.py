"""A recording from the emulated board without a port: run, decode, add what the table's instruments read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.adxl345.registers import TICKS_PER_SECOND, Adxl345Options
from firmware_bridge.frames.commands import (
    RATE_CODE_AUTO,
    Command,
    Identity,
    encode_command,
    parse_message,
    sample_at,
    set_range,
)
from firmware_bridge.frames.decoder import SampleDecoder, Samples, StreamCounts
from firmware_bridge.host.clock import SampleRate
from firmware_bridge.loop.board_process import BoardProcess
from firmware_bridge.loop.physics import RidePhysics, Scene
from gfimu.base.declared import Declared, Line, Table, figure
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult
from gfimu.base.version import __version__
from gfimu.recording import Recording
from gfimu.recording.carried_array import array_metadata

__all__ = ["VirtualRun", "record_virtual", "typical_chips"]

_BOOT_S = 0.02
_SETUP_S = 0.05
_SLICE_S = 0.5
_NO_READING = -(1 << 15)
_CLOCK_TIMER = 1  # of the firmware's time stamps: it begins some time after power-on
_CLOCK_ERROR_STD = 0.005


@dataclass(frozen=True)
class VirtualRun(Declared, PlottedResult):
    """What the firmware on the emulated board sent, as a recording.

    Parameters
    ----------
    recording : Recording
        The samples, in m/s², with the references of the scene.
    """

    recording: Recording
    stream: Annotated[StreamCounts, figure("How the stream came in.")]
    identity: Annotated[Identity | None, figure("What the board stated about itself.")]
    warnings: Annotated[
        tuple[str, ...], figure("What the firmware did that the processor's documents advise against.")
    ] = ()
    files: Annotated[Mapping[str, Path], figure("Files and folders that were written, by what they are.")] = field(
        default_factory=dict
    )

    @property
    def metadata(self) -> Mapping[str, Any]:
        """Metadata of the recording."""
        return self.recording.metadata

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns of the recording."""
        return self.recording.to_columns()

    def to_rerun(self, path: str | Path) -> Path:
        """Write the recording as a rerun recording (`gfimu.Recording.to_rerun`)."""
        return self.recording.to_rerun(path)

    def shown(self) -> Iterator[Table | Line]:
        """Yield the tables and sentences that people read."""
        rate = self.metadata.get("time_stamp_rate_hz", self.metadata["sample_rate_hz"])
        recorded = ("recorded", f"{len(self.recording.t_s)} at {rate:.1f} Hz")
        yield Table(self._heading(), ("quantity", "value"), [recorded, *self._facts()])
        for warning in self.warnings:
            yield Line(f"warning from the board: {warning}", "yellow")

    def _heading(self) -> str:
        return "Recording of the emulated board"

    def _facts(self) -> list[tuple[str, str]]:
        counts = [(name, str(getattr(self.stream, name))) for name in ("samples", "lost", "corrupt")]
        return counts + ([] if self.identity is None else [("firmware", self.identity.firmware)])

    def _notes(self) -> tuple[str, ...]:
        return self.warnings

    def _panels(self) -> list[Panel]:
        return self.recording._panels()


def typical_chips(seed: int) -> tuple[Adxl345Options, ...]:
    """Draw four chips with clocks of their own: a rate error of 0.5 % (the data sheet gives none) and any phase."""
    chance = np.random.default_rng([seed, 3])
    return tuple(
        Adxl345Options(clock_error=float(chance.normal() * _CLOCK_ERROR_STD), phase=float(chance.uniform()))
        for _ in range(4)
    )


def record_virtual(
    scene: Scene,
    duration_s: float,
    *,
    rate_hz: int = 100,
    range_g: int = 16,
    full_resolution: bool = True,
    rate_code: int = RATE_CODE_AUTO,
    image: str | Path = "gfimu",
    chips: Sequence[Adxl345Options] | None = None,
    fast: bool | None = None,
    lose_every: int = 0,
    progress: Callable[[float], None] | None = None,
) -> VirtualRun:
    """Run the firmware on the emulated board through a scene and return what a host would have recorded.

    Parameters
    ----------
    scene : Scene
        Where the board is (`sim.ride.Ride`).
    duration_s : float
        Virtual time, s.
    rate_hz, range_g, full_resolution, rate_code
        What the host asks of the firmware; ``rate_code`` is the chips' BW_RATE.
    image : str or Path
        Firmware.
    chips : sequence of Adxl345Options, optional
        The chips; by default `typical_chips` of the scene's seed.
    fast : bool, optional
        Whether the peripherals run in C; by default where possible.
    lose_every : int
        Fault: every so many sample interrupts one is lost.
    progress : callable, optional
        Receives the share done, 0 to 1.
    """
    setup = set_range(range_g, full_resolution=full_resolution) + sample_at(rate_hz, rate_code)
    options = typical_chips(scene.seed) if chips is None else tuple(chips)
    decoder = SampleDecoder()
    parts: list[Samples] = []
    identity: Identity | None = None
    physics = RidePhysics(scene)
    with BoardProcess(physics, image=image, chips=options, fast=fast, lose_every=lose_every) as board:
        board.run_for(_BOOT_S)
        board.receive(setup)
        board.receive(encode_command(Command.IDENTIFY))
        now = board.run_for(_SETUP_S)
        clock_began = now / TICKS_PER_SECOND - board.timer(_CLOCK_TIMER) / decoder.format.clock_hz
        decoder.feed(board.take_sent()[0])  # samples from before the board was set up
        end = round(duration_s * TICKS_PER_SECOND)
        while now < end:
            now = board.run_until(min(end, now + round(_SLICE_S * TICKS_PER_SECOND)))
            parts.append(decoder.feed(board.take_sent()[0]))
            if progress is not None:
                progress(now / end)
        warnings = tuple(board.warnings())
    for packet in decoder.messages:
        message = parse_message(packet)
        identity = message if isinstance(message, Identity) else identity
    if not parts or not sum(map(len, parts)):
        raise InputError(f"no sample in {duration_s:g} s of virtual time; run longer, or look at the image {image}")
    samples = Samples.join(parts)
    scale = 1.0 if full_resolution else range_g / 2.0
    readings = np.where(samples.counts == _NO_READING, np.nan, samples.counts * (scale * scene.lsb))
    t = samples.ticks / decoder.format.clock_hz
    rate = SampleRate(decoder.format.clock_hz)
    rate.add(samples)
    recording = Recording(
        t,
        readings,
        scene.array.channels,
        scene.references(t + clock_began),
        {
            **array_metadata(scene.array),
            "part": scene.array.chips[0].part,
            "sample_rate_hz": rate_hz,
            "range_g": range_g,
            "source": "emulated LPC1768",
            "software_version": __version__,
            "frames_lost": decoder.counts.lost,
            **({} if identity is None else identity.conversions),
            **rate.metadata(),
            **scene.metadata,
        },
        {"status": samples.status},
    )
    return VirtualRun(recording, decoder.counts, identity, warnings)
