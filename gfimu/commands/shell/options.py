"""The options that several commands take: one name, one description and one way to complete each.

What is special to a command goes behind the common description or before it (`Option.also`).
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.files.outputs import RECORDING, RERUN, OutputFile
from gfimu.commands.shell import completion
from gfimu.commands.shell.declare import Group, Option

if TYPE_CHECKING:
    from gfimu.recording.importing import ColumnMap

FOREIGN = "A file of another layout"


def picture_file(*endings: str) -> OutputFile:
    """Return the kind of output that is a picture with one of these endings."""
    return OutputFile("a picture", endings, dict.fromkeys(endings, ("matplotlib",)), any_case=True)


def _named(text: str, metavar: str, offers: Any, *, kind: Any = str, **settings: Any) -> Option:
    """Return the option for a file that may be given by the name of one that comes with gfimu."""
    return Option(text, metavar, offers=offers, kind=kind, reads=True, **settings)


def file_argument(text: str, metavar: str, kind: Any = Path) -> Option:
    """Return the option for a file that is read and named by position; several where the kind is a list."""
    return Option(text, metavar, kind=kind, argument=True, reads=True)


ALLOW_CODE = Option("Let a file run the Python code that it names: only a file that you trust.")
ARRAY = _named("Array: a name, an array file (.toml) or an MJCF file with sites (.xml)", "ARRAY", completion.arrays)
BAUD = Option("Speed of the line, bits per second", "BAUD")
BIAS_MG = Option("Bias of each channel, 1 σ, mg", "MG")
BIAS_STD_M_S2 = Option("Standard deviation of each channel's bias, m/s²", "M/S²")
BY = Option("Factor to group by; may be repeated. A range is cut into fifths.", "FACTOR", kind=list[str])
CALIBRATION = Option("Calibration to apply first (.json, from gfimu calibrate).", "FILE", reads=True)
CHIPS = Option("Number of chips", "N")
DATA = Option("Folder of the measured data, for the set real.", "DIR", reads=True)
DURATION = Option("Length of the run, s", "S")
ESTIMATE_OUT = Option("Estimate to write (.csv, .parquet)", writes=OutputFile("an estimate", (".csv", ".parquet")))
FORCE = Option("Go on where the checks of units, time, array and channels refuse the file")
GRAVITY = Option("Local gravity, m/s²", "M/S²")
GYRO = Option("Fuse the gyro columns as well")
IMAGE = _named("Image: gfimu, selfcheck, or an ELF or .bin file.", "IMAGE", ("gfimu", "selfcheck"))
KEEP_FAULTY = Option("Use channels that contradict the others, too")
LATITUDE = Option("Latitude, degrees", "DEG")
LIMIT = Option("Only so many worlds of each set, which stand in random order.", "N", least=1)
MAX_MEMORY = Option(
    "Memory that reading a file may take, as 2GB; by default four times its size and 500 MB", "SIZE", kind=str
)
NOISE_UG = Option("White noise of each channel, one-sided density, µg/√Hz", "UG")
PART = Option("Part of every chip", "PART", offers=completion.parts)
PICTURE = Option("Picture to write (.png, .svg, .pdf)", "FILE", writes=picture_file(".png", ".svg", ".pdf"))
PORT = Option("Port of the board", "PORT")
PROGRESS = Option("Called with the share done, 0 to 1, and a line of text", shell=False)
RANGE = Option("Range of the chips: ±2, 4, 8 or 16 g", "G")
RATE = Option("Sample rate, Hz", "HZ")
RECORDINGS = file_argument("Recordings of one rig: .csv, .parquet, .bin", "RUN...", list[Path])
RECORDING_OUT = Option("Recording to write (.csv, .parquet)", "FILE", writes=RECORDING, what="recording")
REST_THRESHOLD = Option("Threshold of rest, reading unit squared; else from the data.", "UNIT²")
RRD = Option("Rerun recording to write (.rrd)", "FILE", writes=RERUN)
SCENARIO = _named("Scenario: a name, or a scenario file (.toml)", "SCENARIO", completion.scenarios)
SCHEMA_OUT = Option("JSON schema to write (.json)", "FILE", writes=OutputFile("a JSON schema", (".json",)))
SEED = Option("Seed of everything left to chance", "N", least=0)
SETS = Option(
    "Set of worlds; may be repeated. All that are drawn by default.",
    "SET",
    kind=list[str],
    offers=("own", "independent", "unlisted", "dcmotor", "real"),
)
SHARE = Option("Called with the share done, 0 to 1.", shell=False)
SPEED_RAD_S = Option("Angular rate, rad/s", "RAD/S")
SPLIT = Option("Worlds to develop on (dev), or those of the published table (test).", "SPLIT")
TABLE = Option("Table, topic or member of a file that holds several.", "NAME", panel=FOREIGN)
TIME_LIMIT = Option("Real time to spend at most, s", "S")
TWIN = _named("Twin, what the simulation assumes: a name, or a twin file (.toml).", "TWIN", completion.twins)
STARTS = ("any", "rest")
START = Option(
    "How the body starts: any (inferred from the first readings) or rest.", "START",
    offers=STARTS,
)  # fmt: skip
WORKERS = Option("Processes to work in; by default one per processor", "N")


ARRAYS = _named(
    "Names, array files (.toml) or MJCF files (.xml); all shipped ones.", "[ARRAY]...", completion.arrays,
    kind=list[str], argument=True,
)  # fmt: skip


_MAP = _named("Column map: a name, or a TOML file (gfimu inspect writes one).", "MAP", completion.maps, name="--map")
_MAP_SET = Option(
    "Set a key of the column map, or with no --map all of it: time.column=t time.unit=ms unit=g channels.a11=ax "
    "drop=corrupt,duplicates; may be repeated.",
    "KEY=VALUE",
)
_REFERENCE_MAP = _named("Column map of the file of references.", "MAP", completion.maps)
_REFERENCE_MAP_SET = Option("Set a key of the reference's column map; may be repeated.", "KEY=VALUE")


def _map_from_options(
    column_map: Annotated[str | None, _MAP] = None,
    map_set: Annotated[list[str], _MAP_SET] = (),  # type: ignore[assignment]
    table: Annotated[str | None, TABLE] = None,
) -> "ColumnMap | None":
    """Return the map that the options of the shell say; None without any."""
    if column_map is None and not map_set:
        return None
    import msgspec

    from gfimu.recording.importing import load_map

    chosen = load_map(column_map, map_set)
    return chosen if table is None else msgspec.structs.replace(chosen, table=table)


MAP_OF_TABLE = Group(
    _map_from_options,
    "What the columns of a foreign file are: a map, its name or TOML file; `gfimu.load_map` changes keys of one.",
    panel=FOREIGN,
    reads=True,
)
"""The map with the table that is meant, of a file that holds several."""

MAP = replace(MAP_OF_TABLE, without=("table",))
"""The map."""


def _reference_map_from_options(
    reference_map: Annotated[str | None, _REFERENCE_MAP] = None,
    reference_map_set: Annotated[list[str], _REFERENCE_MAP_SET] = (),  # type: ignore[assignment]
) -> "ColumnMap | None":
    """Return the map of the references that the options of the shell say; None without any."""
    return _map_from_options(reference_map, reference_map_set)


REFERENCE_MAP = Group(
    _reference_map_from_options,
    "What the columns of a foreign file of references are: a map, its name or TOML file.",
    panel=FOREIGN,
    reads=True,
)
"""The map of a file of references."""
