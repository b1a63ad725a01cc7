"""Every command of the program with bad input of every kind: files, contents, numbers and text.

``python -m tests.fuzz --commands`` runs all of them; `tests/cli/test_bad_input.py` runs a few of each by lot. A call
ends well if its exit code is 0 or 2, and if 2 with one line on standard error and nothing on standard output.
"""

from __future__ import annotations

import contextlib
import copy
import io
import json
import re
import shutil
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import typer

__all__ = [
    "CALLS",
    "CONTENTS",
    "commands",
    "complaint",
    "content_variants",
    "make_inputs",
    "run",
    "run_all",
    "variants",
]

CALLS = {
    "demo": "",
    "start": "start turn.csv --rig table --array array.toml --out new_folder",
    "list": "list arrays",
    "show": "show twin.toml",
    "new": "new array --out new.toml",
    "schema": "schema score",
    "inspect": "inspect foreign.csv",
    "convert": "convert foreign.csv new.csv --map map.toml",
    "join": "join turn.csv tacho.csv --out new.csv",
    "record": "record --port socket://127.0.0.1:1 --out new.csv --array array.toml --rate 100 --duration 1",
    "calibrate": "calibrate array poses.csv --out new.json",
    "certificate": "certificate cal.json --out new_folder",
    "noise": "noise rest.csv",
    "estimate": "estimate turn.csv --out new.csv --array array.toml --method algebraic",
    "impact": "impact turn.csv --array array.toml",
    "live": "live --from turn.csv --array array.toml --rate 100",
    "view": "view turn.csv --out new.rrd",
    "check": "check turn.csv --twin twin.toml",
    "diagnose": "diagnose short.csv --twin twin.toml --out new_folder",
    "design": "design bias scale_factor --twin twin.toml --evaluations 1 --duration 10",
    "benchmark list": "benchmark list",
    "benchmark worlds": "",
    "benchmark run": "",
    "benchmark judge": "benchmark judge answers.jsonl --partial",
    "benchmark table": "benchmark table judged.jsonl",
    "score": "score array.toml",
    "optimize": "optimize brief.toml --restarts 1",
    "drift": "drift --array array.toml --bias-mg 1",
    "tolerance": "tolerance array.toml --closed-form --duration 4",
    "simulate": "simulate scenario.toml --out new.csv",
    "campaign run": "campaign run plan.toml --out new_folder --workers 1",
    "campaign status": "campaign status campaign",
    "campaign table": "campaign table campaign",
    "campaign plot": "campaign plot campaign --out new.html",
    "firmware run": "firmware run --scenario scenario.toml --duration 0.1 --out new.csv",
    "firmware build": "",
    "firmware selftest": "",
    "firmware trace": "firmware trace --scenario scenario.toml --duration 0.01 --out new.vcd",
    "firmware faults": "",
    "firmware check": "firmware check image.bin --duration 0.01",
}
"""A call of each command that is right but for what `variants` changes; none of those that take no file of a user's."""

CONTENTS = {
    "array.toml": "score array.toml",
    "twin.toml": "check turn.csv --twin twin.toml",
    "scenario.toml": "simulate scenario.toml --out new.csv",
    "plan.toml": "campaign plan.toml --out new_folder --workers 1",
    "map.toml": "convert foreign.csv new.csv --map map.toml",
    "brief.toml": "optimize brief.toml --restarts 1",
    "part.toml": "show part.toml",
    "frame.toml": "show frame.toml",
    "stage.toml": "certificate cal.json --stage stage.toml --out new_folder",
    "cal.json": "convert cal.json new.yaml --to kalibr",
    "answers.jsonl": "benchmark judge answers.jsonl --partial",
    "judged.jsonl": "benchmark table judged.jsonl",
}
"""A file of each kind, and a call that reads it."""

_FILES = {
    "folder": None,
    "empty": b"",
    "latin1": "name = 'café'\nt_s,é\n1,2\n".encode("latin-1"),
    "zeros": bytes(100),
    "binary": bytes(np.random.default_rng(0).integers(0, 256, 3000, dtype=np.uint8)),
    "deep.toml": b"name = " + b"[" * 5000 + b"]" * 5000,
    "deep.json": b'{"a":' * 3000 + b"1" + b"}" * 3000,
    "long number": b"x = " + b"9" * 6000,
    "surrogate": b'name = "\xed\xa0\x80"\n',
    "json": b'{"kind": 3}',
    "list": b"[1, 2, 3]",
    "toml": b"kind = 3\n",
    "text": b"hello\nworld\n",
}
_NAMES = {"no text": "caf\udce9{}", "too long": "n" * 300 + "{}", "unreadable": "/proc/self/mem", "device": "/dev/null"}
_OUTPUTS = ("folder", "no/such/{}", "/proc/{}", "/dev/full", "n\udce9{}", "", "/", "n" * 300 + "{}", "x.qqq")
_NUMBERS = ("1e308", "-1e308", "9e29", "2e-60", "1e-308", "inf", "nan", "-1", "0", "9" * 400, "x")
_TEXTS = ("", "x", "caf\udce9", "\x1b[31m", "=", "x.y=1e308", "a=[[[[")
_VALUES = (1e308, 9e29, -9e29, 2e-60, np.nan, 10**400, 10**18, 0, -1, "", "\x1b[31m\u202e\n", True, [], {}, [[1]], None)
_WAITING = {"--reconnect"}  # waits as long as it says
_OF_FILES = {"ARRAY", "TWIN", "MAP", "SCENARIO", "FILE", "RUN", "CAL", "PLAN", "BRIEF", "IMAGE", "DIR", "PART"}


def commands() -> dict[str, Any]:
    """Return every command of the program by its words."""
    from gfimu.commands import program

    found: dict[str, Any] = {}
    for name, command in typer.main.get_command(program()).commands.items():
        inner = getattr(command, "commands", None)
        found |= {f"{name} {sub}": one for sub, one in inner.items()} if inner else {name: command}
    return found


def make_inputs(folder: Path) -> None:
    """Write the files that the calls read, and the bad ones, into a folder that is the current one."""
    import gfimu

    gfimu.simulate("paper_run", seed=1, changes=["duration_s=8"], out="turn.csv")
    gfimu.simulate("paper_run", seed=1, changes=["duration_s=2"], out="short.csv")
    gfimu.simulate("rest", seed=1, changes=["duration_s=8"], out="rest.csv")
    gfimu.simulate("calibration_poses", seed=1, out="poses.csv")
    gfimu.calibrate("multi-position", "poses.csv", out="cal.json")
    for name, shown in (("array", "cube12"), ("twin", "cube12_turntable"), ("scenario", "paper_run")):
        (folder / f"{name}.toml").write_text(gfimu.show(shown), encoding="utf-8")
    for kind in ("brief", "frame", "part", "stage"):
        gfimu.new(kind, out=f"{kind}.toml")
    rows = "".join(f"{k / 100},0,{np.sin(k):.4f},1\n" for k in range(400))
    (folder / "foreign.csv").write_text(f"time_s,ax_g,ay_g,az_g\n{rows}")
    gfimu.inspect("foreign.csv", out="map.toml")
    rows = "".join(f"{0.05 * k},{np.sin(0.05 * k):.5f}\n" for k in range(160))
    (folder / "tacho.csv").write_text(f"t_s,tacho_rad_s\n{rows}")
    (folder / "plan.toml").write_text('kind = "measure"\n[factors]\n"eccentricity.x_m" = [0.0, 0.001]\n')
    (folder / "campaign").mkdir()
    shutil.copy(folder / "plan.toml", folder / "campaign")
    (folder / "answers.jsonl").write_text('{"world": "own/dev/000", "verdict": "unknown", "method": "m"}\n')
    gfimu.benchmark.judge("answers.jsonl", out="judged.jsonl", partial=True)
    (folder / "image.bin").write_bytes(bytes(400))
    for kind, content in _FILES.items():
        (folder / kind).mkdir() if content is None else (folder / f"bad {kind}").write_bytes(content)
    (folder / "circle").symlink_to("circle")
    (folder / "vanished").symlink_to("nowhere")


def _bad_files(suffix: str) -> Iterator[tuple[str, str]]:
    yield "folder", "folder"
    yield from ((kind, f"bad {kind}") for kind, content in _FILES.items() if content is not None)
    yield from ((kind, kind) for kind in ("circle", "vanished"))
    yield from ((kind, name.format(suffix)) for kind, name in _NAMES.items())


def variants(words: str, command: Any) -> Iterator[tuple[str, list[str]]]:
    """Yield calls of a command, each with one thing wrong, by what that is; the inputs are in the current folder."""
    call = CALLS[words].split()
    for place, word in enumerate(call):
        if place and Path(word).exists():
            for kind, name in _bad_files(Path(word).suffix):
                yield f"{word}: {kind}", [*call[:place], name, *call[place + 1 :]]
        elif word.startswith("new") and place:
            for name in _OUTPUTS:
                yield f"output {name[:9]!r}", [*call[:place], name.format(Path(word).suffix), *call[place + 1 :]]
    for param in command.params:
        option = param.opts[-1]
        if not option.startswith("--") or option in {"--json", *_WAITING} or getattr(param, "is_flag", False):
            continue
        at = call.index(option) if option in call else len(call)
        rest, count = call[:at] + call[at + 2 :], max(getattr(param, "nargs", 1) or 1, 1)
        kind = str(param.type_descriptor).lower()
        if "int" in kind or "float" in kind:
            wrong: list[str] = list(_NUMBERS)
        elif "path" in kind or (param.metavar or "") in _OF_FILES:
            wrong = [] if option in call else [name for _, name in _bad_files(".toml")]
        else:
            wrong = list(_TEXTS)
        yield from ((f"{option} {one[:12]!r}", [*rest, option, *[one] * count]) for one in wrong)
    yield "argument that is no text", [*call, "caf\udce9"]
    yield "option that is no text", [*call, "--caf\udce9"]


def content_variants(name: str) -> Iterator[tuple[str, str]]:
    """Yield contents of a file of `CONTENTS`, each with one value or key changed, by what was changed."""
    text = Path(name).read_text(encoding="utf-8")
    of_toml = name.endswith(".toml")
    data = tomllib.loads(text) if of_toml else json.loads(text if name.endswith(".json") else text.splitlines()[0])
    for path in _paths(data):
        for value in _VALUES:
            with contextlib.suppress(TypeError):  # of what TOML has not
                changed = _with(data, path, value)
                yield f"{path} = {value!r:.20}", tomli_w.dumps(changed) if of_toml else json.dumps(changed)
        if isinstance(path[-1], str):
            for key in ("", "x", "é_1", "a\nb", "\x1b[3m"):
                changed = _with(data, path, None, key)
                yield f"{path}: key {key!r}", tomli_w.dumps(changed) if of_toml else json.dumps(changed)


def _paths(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the places of a content, of a list the first alone."""
    if path:
        yield path
    inner = value.items() if isinstance(value, dict) else enumerate(value[:1]) if isinstance(value, list) else ()
    for key, one in inner:
        yield from _paths(one, (*path, key))


def _with(data: Any, path: tuple[Any, ...], value: Any, key: str | None = None) -> Any:
    """Return a content with another value at a place, or with what is there under another key."""
    changed = place = copy.deepcopy(data)
    for step in path[:-1]:
        place = place[step]
    if key is None:
        place[path[-1]] = value
    else:
        place[key] = place.pop(path[-1])
    return changed


def run_all(only: str | None) -> int:
    """Run every variant, print those that end badly, and return how many do."""
    failed = total = 0
    with tempfile.TemporaryDirectory(prefix="gfimu-fuzz-") as name, contextlib.chdir(name):
        make_inputs(Path(name))
        cases = [
            (label, call, "", "")
            for words, command in commands().items()
            if CALLS[words] and only in {None, words}
            for label, call in variants(words, command)
        ]
        for file, call in CONTENTS.items():
            if only in {None, file}:
                cases += [(label, call.split(), file, content) for label, content in content_variants(file)]
        for label, call, file, content in cases:
            before = Path(file).read_text(encoding="utf-8") if file else ""
            if file:
                Path(file).write_text(content, encoding="utf-8", errors="surrogatepass")
            said = complaint(*run(call))
            if file:
                Path(file).write_text(before, encoding="utf-8")
            for new in Path().glob("new*"):
                shutil.rmtree(new) if new.is_dir() else new.unlink()
            total, failed = total + 1, failed + bool(said)
            if said:
                print(
                    f"{' '.join(call)!r} ({file} {label}): {said}".encode(errors="backslashreplace").decode(),
                    flush=True,
                )
    print(f"{total} calls, {failed} ended badly")
    return failed


def run(arguments: list[str]) -> tuple[int, str, str]:
    """Return exit code, standard output and standard error of a call in this process."""
    from gfimu.commands import main

    out, err = io.StringIO(), io.StringIO()
    sys.argv = ["gfimu", *arguments]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as stop:
            return int(stop.code or 0), out.getvalue(), err.getvalue()
    return 0, out.getvalue(), err.getvalue()


def complaint(code: int, stdout: str, stderr: str) -> str:
    """Return what is wrong with the end of a call; empty if nothing is."""
    lines = [line for line in stderr.splitlines() if not line.startswith("gfimu: warning: ")]
    if code not in {0, 2}:
        return f"exit code {code}: {stderr[-300:]}"
    if re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e]", stdout + stderr):
        return "characters that steer the terminal"
    if code == 0:
        return f"on standard error: {stderr[-300:]}" if any(not line.startswith("gfimu: ") for line in lines) else ""
    if len(lines) != 1 or not lines[0].startswith("gfimu: ") or len(lines[0]) > 2500:
        return f"not one line: {stderr[-300:]}"
    return "refused, and something on standard output" if stdout else ""
