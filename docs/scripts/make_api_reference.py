"""Write the pages of the API reference, docs/reference/api/, from the public names; Sphinx fills in the docstrings.

Sphinx runs this before it reads the pages (docs/conf.py). A new public name of `gfimu` appears without a change here,
on the page of the package that holds it.

Run ``python docs/scripts/make_api_reference.py``.
"""

from __future__ import annotations

import inspect
import types
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path

from gfimu.base.lazy_names import homes_of

FOLDER = Path(__file__).resolve().parents[1] / "reference" / "api"

GROUPS = {
    "commands": ("Commands as functions", ("gfimu.commands",)),
    "recordings": (
        "Recordings and errors",
        ("gfimu.recording", "gfimu.base.errors", "gfimu.recording.importing", "gfimu.recording.joining"),
    ),
    "geometry": ("Arrays and kinematics", ("gfimu.array", "gfimu.array_search")),
    "motion": ("Motion, attitude and navigation", ("gfimu.motion", "gfimu.rate.axis", "gfimu.motion.impact")),
    "rate": ("Angular rate and its bounds", ("gfimu.rate", "gfimu.rate.bounds")),
    "calibration": (
        "Calibration and noise",
        ("gfimu.calibration", "gfimu.calibration.certificate", "gfimu.sensor_noise"),
    ),
    "drift": ("Position drift", ("gfimu.budget.drift",)),
    "diagnosis": ("Diagnosis", ("gfimu.diagnosis",)),
    "twins": ("Scenarios and twins", ("sim",)),
    "further": ("Further names", ()),
}
"""Pages of `gfimu`, each with its title and the packages whose public names it holds; the first that fits counts."""

OTHERS = {
    "sim": (
        "Simulation",
        "Package `sim`. The parts that a program may build on: motions, sensors, effects and worlds.",
        {
            "sim.simulation": ("simulate",),
            "sim.world": ("World",),
            "sim.motions.motion": ("SpinMotion", "BodyMotion", "SpinState", "BodyState"),
            "sim.motions.profiles": ("spin_profile", "Hold", "Ramp", "Sine", "Chirp", "Tumble"),
            "sim.chips.adxl345": ("Sensor", "SensorErrors", "SensorSettings"),
            "sim.chips.data_sheet": ("DataSheet",),
            "sim.effects": ("Effect",),
            "sim.trials.worlds.factory": ("WorldFactory", "MeasuredWorld"),
        },
    ),
    "firmware_bridge": (
        "Boards and frames",
        "Package `firmware_bridge`. Frames on the wire, recording from a port, sources, the emulated board.",
        {
            "firmware_bridge.frames.frame_format": ("FrameFormat", "Status"),
            "firmware_bridge.frames.format_file": ("load_format",),
            "firmware_bridge.frames.decoder": ("SampleDecoder", "Samples", "StreamCounts"),
            "firmware_bridge.host.finder": ("find_boards", "Found"),
            "firmware_bridge.host.record_report": ("RecordReport",),
            "firmware_bridge.host.recorder": ("record",),
            "firmware_bridge.host.clock": ("ClockFit", "HostClock"),
            "firmware_bridge.sources.source": ("Source",),
            "firmware_bridge.sources.klipper": ("KlipperSource",),
            "firmware_bridge.sources.phyphox": ("PhyphoxSource",),
            "firmware_bridge.sources.udp": ("UdpSource",),
            "firmware_bridge.loop.virtual_run": ("record_virtual", "VirtualRun"),
        },
    ),
}
"""Pages of the other packages: title, what they hold, and their names by module."""


def page_of(module: str) -> str:
    """Return the page on which the public names of a module stand."""
    fits = (
        page
        for page, (_, packages) in GROUPS.items()
        for package in packages
        if module == package or module.startswith(package + ".")
    )
    return next(fits, "further")


def pages() -> dict[str, str]:
    """Return the text of every page by its name."""
    names: dict[str, list[str]] = {page: [] for page in GROUPS}
    for name, module in sorted(homes_of("gfimu").items(), key=lambda item: item[0].lower()):
        if name != "__version__":
            names[page_of(module)].append(name)
    texts = {
        page: _page(title, "Names of `gfimu`: `from gfimu import …`.", {"gfimu": names[page]})
        for page, (title, _) in GROUPS.items()
        if names[page]
    }
    texts |= {page: _page(*content) for page, content in OTHERS.items()}
    contents = "\n".join(texts)
    texts["index"] = f"""\
# Python API
The public names by what they are for. They load on first use, and type checkers see their types. What is not on these
pages may change without notice.

```{{toctree}}
{contents}
```
"""
    return texts


def _page(title: str, introduction: str, names: dict[str, Iterable[str]]) -> str:
    rows, directives = [], []
    for module, inside in names.items():
        for name in inside:
            thing = getattr(import_module(module), name)
            target = thing.__name__ if isinstance(thing, types.ModuleType) else f"{module}.{name}"
            rows.append(f"| {{py:obj}}`{name} <{target}>` | {_first_line(thing)} |")
            directives += [f".. currentmodule:: {module}", "", *_directive(thing, name, module), ""]
    return "\n".join(
        [
            f"# {title}",
            introduction,
            "",
            "| name | purpose |",
            "|---|---|",
            *rows,
            "",
            "```{eval-rst}",
            *directives,
            "```",
            "",
        ]
    )


def _directive(thing: object, name: str, module: str) -> list[str]:
    if isinstance(thing, types.ModuleType):
        return [f".. automodule:: {thing.__name__}", "   :members:"]
    return [f".. {'autoclass' if inspect.isclass(thing) else 'autofunction'}:: {module}.{name}"]


def _first_line(thing: object) -> str:
    return (inspect.getdoc(thing) or "").split("\n\n")[0].replace("\n", " ").replace("|", "\\|")


def write_pages(folder: Path = FOLDER) -> list[Path]:
    """Write the pages whose text has changed; return all."""
    folder.mkdir(exist_ok=True)
    made = []
    for name, text in pages().items():
        path = folder / f"{name}.md"
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
        made.append(path)
    return made


if __name__ == "__main__":
    write_pages()
