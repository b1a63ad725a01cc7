"""Begin with files of your own: read them, ask for what they don't show, and write map, array, twin and recording.

Writes a folder with the recording, the column maps, the array and the twin of the rig, and prints the next two
commands. On a terminal it asks for what is open; otherwise options state it.

Examples
--------
gfimu start pendulum.csv --rig pendulum --part adxl355
# Accelerometers and the tachometer of a table on clocks of their own
gfimu start chips.csv tacho.csv --rig table --part adxl345
# A toolhead that a printer moves along x
gfimu start toolhead.csv moves.csv --rig axis --part adxl345 --rate-hz 3200
"""

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from gfimu.base.errors import InputError, did_you_mean
from gfimu.base.files.outputs import OutputFolder, check_outputs
from gfimu.commands import given
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import MAX_MEMORY, PART, file_argument

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray
    from gfimu.commands.started import Started
    from gfimu.recording import Recording
    from gfimu.recording.importing import ColumnMap, Inspection
    from sim.twin import Twin

__all__ = ["FOLDER", "start"]

Rig = Literal["table", "pendulum", "axis", "body"]
RIGS: dict[str, str] = {
    "table": "a turntable; its axis is vertical, its tachometer or encoder is the reference",
    "pendulum": "an arm that swings about a horizontal axis and hangs at the angle zero",
    "axis": "a carriage that moves along a straight line",
    "body": "a body that moves freely; its gyro is the reference, if it has one",
}
FOLDER = OutputFolder(("run.parquet", "map.toml", "reference_map.toml", "array.toml", "twin.toml"))
"""What the folder holds; the map of references where they are a file of their own."""

_FILES = file_argument("Files of one run: accelerometers, and a reference or further loggers.", "FILE...", list[Path])
_OUT = Option("Folder to write; made where it is not there.", "DIR", writes=FOLDER)
_RIG = Option(f"What moved: {', '.join(RIGS)}.")
_PLACE = Option("Place of a chip from the axis, or in the body; one for each chip.", "X,Y,Z m", kind=list[str])
_RATE = Option("Sample rate, Hz, where the file states none.", "HZ")
_YES = Option("Take guesses that are to be checked.")
_ASK = Option("Asks a question, given its text and a default answer, and returns the answer.", shell=False)
_Ask = Callable[[str, str], str]
_DRIVES = {
    "table": ("tacho", "angle", "command"),
    "pendulum": ("angle", "tacho"),
    "axis": ("carriage",),
    "body": ("gyro",),
}  # sources of a twin's drive, the best first
_COLUMNS = {
    "tacho": "tacho_rad_s",
    "angle": "angle_rad",
    "command": "command_rad_s",
    "carriage": "carriage_m",
    "gyro": "gyro_z_rad_s",
}
_ONE_AXIS = 0.2  # of the rate about the axis of a pendulum: what it may turn about others, as a loose hinge


def _run(options: Mapping[str, Any], as_json: bool) -> None:
    from gfimu.commands.shell.output import print_json
    from gfimu.commands.shell.printing import print_blocks

    result = start(**options, ask=_prompted if sys.stdin.isatty() and not as_json else None)
    if as_json:
        print_json(result.to_dict())
    else:
        print_blocks(result.shown())


def _prompted(text: str, default: str) -> str:
    import typer

    return str(typer.prompt(text, default=default or None))


@command(run=_run)
def start(
    files: Annotated["str | Path | Sequence[str | Path]", _FILES],
    *,
    out: Annotated["str | Path | None", _OUT] = None,
    rig: Annotated[Rig | None, _RIG] = None,
    part: Annotated[str | None, PART.also(", as adxl345; gfimu list parts has them")] = None,
    place_m: Annotated["Sequence[str | Sequence[float]]", _PLACE] = (),
    rate_hz: Annotated[float | None, _RATE] = None,
    array: given.Array = None,
    column_map: given.Map = None,
    max_memory: Annotated[Any, MAX_MEMORY] = None,
    yes: Annotated[bool, _YES] = False,
    ask: Annotated[_Ask | None, _ASK] = None,
) -> "Started":
    """Read files of one's own into a recording, with the map, the array and the twin that go with it.

    Axes of the chips, and the distance of a single chip from the axis, follow from the readings where they are not
    given: they are those by which the twin predicts the readings best.

    Raises
    ------
    InputError
        If a file can't be read, something is open that nobody is asked for, or the clocks can't be aligned.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.start("pendulum.csv", rig="pendulum", part="adxl355").next_commands  # doctest: +SKIP
    """
    from gfimu.base.files.atomic_file import write_text
    from gfimu.commands.started import Started

    paths = [Path(files)] if isinstance(files, str | Path) else [Path(one) for one in files]
    folder = Path(out) if out is not None else paths[0].with_name(f"{paths[0].name.partition('.')[0]}-gfimu")
    check_outputs([("out", folder, FOLDER)])
    answers = _Answers(ask, yes)
    read = [_looked_at(path, answers, rate_hz, max_memory, column_map if path == paths[0] else None) for path in paths]
    recording, maps, reasons = _one_recording(paths, read, array)
    kind = rig or answers.choice("What moved?", RIGS, _likely_rig(recording), "--rig")
    source, swings = _source(recording, kind), recording
    if kind == "pendulum" and "gyro_z_rad_s" in recording.reference and not source:
        recording, swings, line = _swung(recording, paths[0])
        reasons.append(line)
        source = "tacho"
    if not source and kind != "body":
        raise InputError(
            f"{paths[0]}: no reference of the rig {kind!r} ({', '.join(_COLUMNS[one] for one in _DRIVES[kind])}); "
            "give the file that holds it too, or name its column in a map"
        )
    drawing, found = _drawn(swings, kind, _source(swings, kind), array, answers, part, place_m)
    folder.mkdir(exist_ok=True)
    write_text(folder / "array.toml", drawing.to_toml())
    _named(recording, drawing).carrying(drawing).write(folder / "run.parquet")
    written = ["run.parquet", "array.toml"]
    for name, text in maps.items():
        write_text(folder / name, text)
        written.append(name)
    if source:
        write_text(folder / "twin.toml", _twin(recording, kind, source, drawing).to_toml())
        written.append("twin.toml")
    run, twin = folder / "run.parquet", folder / "twin.toml"
    following = (
        (f"gfimu check {run} --twin {twin}", f"gfimu diagnose {run} --twin {twin} --out {folder / 'diagnosis'}")
        if source
        else (f"gfimu estimate {run} --out {folder / 'estimate.parquet'}", f"gfimu view {run}")
    )
    return Started(str(folder), kind, tuple(written), (*reasons, *found), following)


@dataclass(frozen=True)
class _Answers:
    """Where answers come from: somebody on a terminal, or options."""

    ask: _Ask | None
    takes_guesses: bool

    def text(self, question: str, default: str, option: str) -> str:
        """Return the answer to a question; raises `InputError` where nobody is asked and there is no default."""
        if self.ask is not None:
            return self.ask(question, default).strip()
        if not default:
            raise InputError(f"{question} State it with {option}")
        return default

    def number(self, question: str, default: str, option: str) -> float:
        """Return a positive number; raises `InputError` for any other answer."""
        answer = self.text(question, default, option)
        try:
            found = float(answer)
        except ValueError:
            found = math.nan
        if not 0.0 < found < math.inf:
            raise InputError(f"{question} {answer!r} is no positive number; state it with {option}")
        return found

    def choice(self, question: str, offers: Mapping[str, str], likely: str, option: str) -> str:
        """Return one of several words."""
        listed = "; ".join(f"{name}: {meaning}" for name, meaning in offers.items())
        found = self.text(f"{question} ({listed})", likely, option)
        if found not in offers and self.ask is not None:
            found = self.text(f"{found!r} is none of {', '.join(offers)}. {question}", likely, option)
        if found not in offers:
            raise InputError(f"{found!r} is none of {', '.join(offers)}{did_you_mean(found, offers)}; give {option}")
        return found

    def confirm(self, path: Path, doubts: Sequence[str]) -> None:
        """Have guesses confirmed that are to be checked."""
        if not doubts or self.takes_guesses:
            return
        if self.ask is None:
            raise InputError(
                f"{path}: to be checked: {'; '.join(doubts)}; --yes takes them, gfimu inspect {path} --out map.toml "
                "writes a map to correct, and --map takes it"
            )
        for doubt in doubts:
            if not self.ask(f"{doubt}. Is that right? (y/n)", "y").lower().startswith("y"):
                raise InputError(
                    f"{path}: correct the map that gfimu inspect --out map.toml writes, and give it as --map"
                )


def _looked_at(
    path: Path, answers: _Answers, rate_hz: float | None, max_memory: Any, column_map: Any
) -> "tuple[Inspection, ColumnMap | None]":
    """Return what a file holds and the map by which it is read, its guesses confirmed; no map for gfimu's own."""
    import msgspec

    from gfimu.base.files.memory import with_memory
    from gfimu.recording.importing import inspect_file, load_map

    seen = inspect_file(with_memory(path, max_memory))
    if column_map is not None:
        return seen, load_map(column_map)
    found = seen.column_map
    if found is None:
        if seen.is_own:
            return seen, None
        raise InputError(f"{path}: {seen.reasons[-1]}")
    doubts = [line.removesuffix(" (check this)") for line in seen.reasons if line.endswith("(check this)")]
    open_rate = [line for line in doubts if "only holds the place" in line]
    if open_rate:
        rate = rate_hz or answers.number(f"{path}: no sample rate. How many samples per second, Hz?", "", "--rate-hz")
        found = msgspec.structs.replace(found, time=msgspec.structs.replace(found.time, rate_hz=rate))
    answers.confirm(path, [line for line in doubts if line not in open_rate])
    return seen, found


def _one_recording(
    paths: Sequence[Path], read: "Sequence[tuple[Inspection, ColumnMap | None]]", array: Any
) -> "tuple[Recording, dict[str, str], list[str]]":
    """Return the recording of all files, aligned where they have clocks of their own, the maps, and what was found."""
    from gfimu.commands.join import join
    from gfimu.recording.importing.column_map import map_toml
    from gfimu.recording.mapped import MappedFile, mapped_recording

    holding = [
        index
        for index, (seen, found) in enumerate(read)
        if (found is None and seen.chips) or (found and found.channels)
    ]
    if not holding:
        raise InputError(f"{paths[0]}: no accelerations found; name their columns in a map (--map)")
    first = holding[0]
    order = [first, *(index for index in range(len(paths)) if index != first)]
    reasons = [
        f"{paths[index].name}: {line}"
        for index in order
        for line in (*read[index][0].reasons, *(doubt.text for doubt in read[index][0].doubts))
        if index == first or "look like accelerations" not in line
    ]
    named = zip(("map.toml", "reference_map.toml"), (read[index][1] for index in order), strict=False)
    maps = {name: map_toml(found) for name, found in named if found is not None}
    main, own = paths[first], read[first][1]
    source: Any = main if own is None else MappedFile(main, own)
    if len(paths) == 1:
        from gfimu.recording.formats import open_recording

        return open_recording(source), maps, reasons
    recording = source
    for index in order[1:]:
        joined = join(recording, paths[index], array=array, reference_map=read[index][1])
        recording = joined.recording
        clock = joined.clock
        reasons.append(
            f"{paths[index].name}: its clock is {clock['offset_s']:.4g} ± {clock['offset_std_s']:.2g} s late at first "
            f"and {100 * clock['rate_error']:.3g} % off in rate"
        )
    return (
        (recording if not isinstance(recording, MappedFile) else mapped_recording(main, recording.column_map)),
        maps,
        reasons,
    )


def _source(recording: "Recording", kind: str) -> str:
    """Return the best source of a rig's drive that a recording has; empty where it has none."""
    return next((one for one in _DRIVES[kind] if _COLUMNS[one] in recording.reference), "")


def _swung(recording: "Recording", path: Path) -> "tuple[Recording, Recording, str]":
    """Return a pendulum's recording with its gyro as the tachometer, another with the angle, and what was done.

    The axis is the direction in which the gyro changes most. A pendulum comes back to where it hangs, so the trend of
    the turned angle is the bias of the gyro, and the angle without trend is that from where it hangs. Too rough to be a
    reference, the angle shows how the chips are mounted.

    Raises
    ------
    InputError
        If it turns about more than one axis.
    """
    import numpy as np
    from scipy.integrate import cumulative_trapezoid

    from gfimu.recording.timing.reference_times import reference_on_rows

    known = reference_on_rows(recording).reference
    gyro = np.column_stack([known[f"gyro_{axis}_rad_s"] for axis in "xyz"])
    seen = np.isfinite(gyro).all(axis=1)
    if seen.sum() < 3:
        raise InputError(f"{path}: the gyro has fewer than three values; give the file that holds them too")
    _, spread, directions = np.linalg.svd(gyro[seen] - gyro[seen].mean(axis=0), full_matrices=False)
    if spread[1] > _ONE_AXIS * spread[0]:
        raise InputError(
            f"{path}: the gyro turns about more than one axis, {100 * spread[1] / spread[0]:.0f} % of its rate about a "
            "second one; fix the axis of the pendulum, or go on with --rig body"
        )
    t, rate = recording.t_s, gyro @ directions[0]
    turned = cumulative_trapezoid(rate[seen], t[seen], initial=0.0)
    trend = np.polyfit(t[seen], turned, 1)
    tacho, angle = rate - trend[0], np.full(len(t), np.nan)
    angle[seen] = turned - np.polyval(trend, t[seen])
    axis = " ".join(f"{part:.3g}" for part in directions[0])
    line = f"no encoder: the rate is that of the gyro about ({axis}), less its bias of {trend[0]:.3g} rad/s"
    return (
        replace(recording, reference={**known, "tacho_rad_s": tacho}),
        replace(recording, reference={**known, "angle_rad": angle}),
        line,
    )


def _likely_rig(recording: "Recording") -> str:
    """Return the rig that the references suggest; empty where they suggest none."""
    import numpy as np

    known = recording.reference
    if "carriage_m" in known:
        return "axis"
    if "angle_rad" in known and float(np.nanmax(known["angle_rad"]) - np.nanmin(known["angle_rad"])) < np.pi:
        return "pendulum"
    if {"tacho_rad_s", "angle_rad", "command_rad_s"} & set(known):
        return "table"
    return "body" if "gyro_z_rad_s" in known else ""


def _drawn(
    recording: "Recording",
    kind: str,
    source: str,
    array: Any,
    answers: _Answers,
    part: str | None,
    places: Sequence[str | Sequence[float]],
) -> "tuple[AccelerometerArray, list[str]]":
    """Return the array: as given, or with the places given or asked for and the axes that the readings show."""
    import numpy as np

    from gfimu.array.array import AccelerometerArray
    from gfimu.commands.opened import as_array
    from gfimu.diagnosis.design.chip_axes import chip_axes, chip_distance

    if array is not None:
        return as_array(array), []
    names = list(recording.channels)
    chips = [names[at : at + 3] for at in range(0, len(names), 3)]
    if len(names) % 3:
        raise InputError(
            f"{len(names)} channels are no whole triads; draw the array (gfimu new array), give it as --array"
        )
    name = part or answers.text("Part of the chips, as adxl345? (gfimu list parts)", "generic", "--part")

    def with_places(places: Sequence[Any], axes: Sequence[Any]) -> AccelerometerArray:
        drawn = [
            {
                "name": chip[0][:-1],
                "part": name,
                "position_m": [float(one) for one in place],
                "axes": np.round(turned, 6).tolist(),
            }
            for chip, place, turned in zip(chips, places, axes, strict=True)
        ]
        return AccelerometerArray.from_dict({"name": "array", "chip": drawn}, source="--place-m")

    square = [np.eye(3)] * len(chips)
    found: list[str] = []
    given_places = [_place(one) for one in places]
    if not given_places and len(chips) == 1:
        given_places = [np.zeros(3)]
        if source in {"tacho", "angle", "command"}:

            def at(distance: float) -> Any:
                return _twin(recording, kind, source, with_places([_arm(kind, distance)], square))

            distance = chip_distance(_named(recording, at(0.0).array), at)
            taken = answers.number("Distance of the chip from the axis, m?", f"{distance:.4g}", "--place-m")
            given_places = [_arm(kind, taken)]
            found.append(f"the chip is {distance:.4g} m from the axis by its readings; {taken:.4g} m is taken")
    if len(given_places) != len(chips):
        raise InputError(
            f"{len(chips)} chips, {len(given_places)} places; give --place-m X,Y,Z for each, or --array FILE"
        )
    drawn = with_places(given_places, square)
    if source and source != "gyro":
        mounted = chip_axes(_named(recording, drawn), _twin(recording, kind, source, drawn))
        found += [
            f"chip {chip[0][:-1]}: its axes are {np.degrees(one.off_square_rad):.2g}° from those of the rig; "
            f"readings differ from the twin's by {one.rms:.2g} m/s² rms"
            for chip, one in zip(chips, mounted, strict=True)
        ]
        drawn = with_places(given_places, [one.axes for one in mounted])
    return drawn, found


def _arm(kind: str, distance: float) -> list[float]:
    """Return the place of a single chip at a distance from the axis: below a pendulum's, beside a table's."""
    return [0.0, -distance, 0.0] if kind == "pendulum" else [distance, 0.0, 0.0]


def _place(value: str | Sequence[float]) -> Any:
    import numpy as np

    try:
        found = np.array([float(one) for one in (value.split(",") if isinstance(value, str) else value)])
    except ValueError:
        found = np.empty(0)
    if found.shape != (3,) or not np.isfinite(found).all():
        raise InputError(f"--place-m {value}: three numbers in metres, as 0.04,0,0.01")
    return found


def _named(recording: "Recording", drawing: "AccelerometerArray") -> "Recording":
    return replace(recording, channels=drawing.channels)


def _twin(recording: "Recording", kind: str, source: str, drawing: "AccelerometerArray") -> "Twin":
    """Return the twin of a rig whose array is beside its file."""
    from sim.twin import Twin

    content: dict[str, Any] = {"sample_rate_hz": float(f"{recording.sample_rate:.6g}"), "drive": {"source": source}}
    if kind == "pendulum":
        content["axis_inclination_rad"] = math.pi / 2.0
    if kind != "body":
        content["cube_offset_m"] = [0.0, 0.0, 0.0]
    part = drawing.chips[0].part
    nominal = Twin.from_dict({**content, "array": "one_chip", "sensor": {"part": part}}, source="the twin")
    return replace(nominal, array=drawing, array_name="array.toml")
