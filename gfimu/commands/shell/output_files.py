"""The files that commands write."""

from gfimu.base.files.outputs import OutputFile

__all__ = [
    "ARRAY_FILE",
    "CALIBRATION",
    "COLUMN_MAP",
    "ESTIMATE",
    "EXPORT",
    "JSON_SCHEMA",
    "KALIBR",
    "PICTURE",
    "SCENARIO",
    "TOML_FILE",
    "TRACE",
]

EXPORT = OutputFile(
    "what is converted",
    (".csv", ".parquet", ".mcap", ".euroc", ".yaml", ".yml", ".xml"),
    {".mcap": ("mcap", "rosbags"), ".xml": ("mujoco",)},
)
ESTIMATE = OutputFile("an estimate", (".csv", ".parquet"))
TRACE = OutputFile("a trace", (".vcd", ".rrd"), {".rrd": ("rerun",)})
CALIBRATION = OutputFile("a calibration", (".json",))
COLUMN_MAP = OutputFile("a column map", (".toml",))
ARRAY_FILE = OutputFile("an array file", (".toml",))
SCENARIO = OutputFile("a scenario file", (".toml",))
TOML_FILE = OutputFile("a TOML file", (".toml",))
KALIBR = OutputFile("a Kalibr file", (".yaml", ".yml"))
JSON_SCHEMA = OutputFile("a JSON schema", (".json",))
PICTURE = OutputFile(
    "a picture", (".png", ".svg", ".pdf"), dict.fromkeys((".png", ".svg", ".pdf"), ("matplotlib",)), any_case=True
)
