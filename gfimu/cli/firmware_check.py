"""`gfimu firmware check`: an image against the rules of the strict board."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json, print_table, print_text, progress
from gfimu.cli.shared_options import JsonOption, shared

if TYPE_CHECKING:
    from firmware_bridge.strict.check import CheckReport
    from firmware_bridge.strict.findings import Finding

__all__ = ["check"]


def check(
    image: Annotated[
        str,
        typer.Argument(
            metavar="[IMAGE]",
            autocompletion=completion.words("gfimu", "selfcheck"),
            help="Image: gfimu, selfcheck, or an ELF or .bin file.",
        ),
    ] = "gfimu",
    duration: Annotated[float, shared("--duration", more=", of virtual time", min=0.0)] = 3.0,
    chips: Annotated[
        int, shared("--chips", more=": ADXL345s on SSP1, 0 to 4; their chip-selects are P2.0 and so on")
    ] = 4,
    baud: Annotated[
        int | None, shared("--baud", more=", that the UARTs are meant to send at; else any usual one")
    ] = None,
    time_limit: Annotated[float, typer.Option("--time-limit", min=0.0, help="Real time to spend at most, s.")] = 60.0,
    json: JsonOption = False,
) -> None:
    """Run an image on a board that reports what a real LPC1768 would not forgive; exit code 1 if there are faults.

    Writes nothing.

    Examples
    --------
    gfimu firmware check build/gfimu.elf
    # An image without chips
    gfimu firmware check blinky.bin --chips 0 --baud 115200 --duration 1
    """
    from gfimu.commands.firmware import check as check_image

    with progress(f"running {image}"):
        report = check_image(image, duration=duration, chips=chips, baud=baud, time_limit=time_limit)
    if json:
        print_json(asdict(report) | {"faults": report.faults})
    else:
        _print_report(report)
    if report.faults:
        raise typer.Exit(1)


def _print_report(report: CheckReport) -> None:
    rows = [("virtual time", f"{report.virtual_s:.4g} s")]
    if report.started_at:
        rows.append(("started", f"at {report.started_at:#x}, as by a boot loader"))
    rows += [
        ("register accesses", str(report.accesses)),
        ("exceptions", str(report.exceptions)),
        ("resets", str(report.resets)),
    ]
    for n, count in enumerate(report.sent):
        if count:
            rows.append((f"sent by UART{n}", f"{count} bytes, {report.baud[n]:.0f} baud {report.character[n]}"))
    if not any(report.sent):
        rows.append(("sent", "nothing"))
    if report.stack_room is not None:
        rows.append(("main stack", f"{report.stack_bytes} of {report.stack_room} bytes used"))
    print_table(f"{report.image} on the strict board", ("quantity", "value"), rows)
    by_rule: dict[str, list[Finding]] = {}
    for finding in report.findings:
        by_rule.setdefault(finding.rule, []).append(finding)
    if by_rule:
        print_table("findings", ("rule", "severity", "count", "first at", "what"), map(_row, by_rule.values()), left=5)
        for places in by_rule.values():
            print_text(f"{_title(places[0])}: {places[0].remedy} ({places[0].source})")
    else:
        print_text("no rule broken", style="green")
    if report.ended:
        print_text(f"the run ended early: {report.ended}", style="yellow")


def _title(finding: Finding) -> str:
    return finding.rule.replace("_", " ")


def _row(places: list[Finding]) -> tuple[str, ...]:
    """One rule with its first place."""
    first = min(places, key=lambda finding: finding.time_s)
    where = f"{first.pc:#x}" + (f" {first.symbol}" if first.symbol else "")
    count = sum(finding.count for finding in places)
    return _title(first), first.severity, str(count), f"{where}, {first.time_s:.6f} s", first.what
