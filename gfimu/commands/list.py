"""List what gfimu ships: arrays, parts, scenarios, twins, effects and other kinds.

Examples
--------
gfimu list arrays
# Names for a script
gfimu list scenarios --json
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from gfimu.base.declared import Table
from gfimu.commands.shell.declare import Option, command

__all__ = ["KINDS", "catalogue", "described"]

_Kind = Literal["arrays", "parts", "maps", "twins", "scenarios", "frames", "effects", "formats"]

KINDS: tuple[str, ...] = get_args(_Kind)
"""What can be listed."""


@dataclass(frozen=True)
class _Listing:
    """Names of one kind, and what each is."""

    kind: str
    names: dict[str, str]

    def to_dict(self) -> dict[str, str]:
        return self.names

    def shown(self) -> Iterator[Table]:
        yield Table(self.kind, ("name", "what it is"), list(self.names.items()), left=2)


@command("list", report=lambda names, given: _Listing(given["kind"], names), results=lambda: (dict[str, str],))
def catalogue(
    kind: Annotated[_Kind, Option(f"What to list: {', '.join(KINDS)}.", "KIND", argument=True)],
) -> dict[str, str]:
    """List what gfimu ships of one kind: name and description, one line each.

    Raises
    ------
    InputError
        If the kind is unknown.

    Examples
    --------
    >>> import gfimu
    >>> sorted(gfimu.catalogue("twins"))
    ['cube12_turntable', 'linear_axis', 'mimu4444_free', 'pendulum', 'wheel_pair']
    """
    if kind == "effects":
        from sim.effects import added_effects
        from sim.effects.catalogue import every_effect

        return {name: family.summary for name, family in (every_effect() | added_effects()).items()}
    if kind == "formats":
        from gfimu.recording.formats import formats
        from gfimu.recording.importing.readers import readers

        whole = {name: form.summary for name, form in formats().items()}
        return whole | {name: reader.summary for name, reader in readers().items()}
    return dict(described(kind))


def described(kind: str) -> Iterator[tuple[str, str]]:
    """Yield names and descriptions of model files; the first comment where a file has no description."""
    from gfimu.base.files.model_files import find_model, list_models, read_toml

    for name in list_models(kind):
        path = find_model(kind, name)
        content = read_toml(path)
        comment = next(
            (line.lstrip("# ") for line in path.read_text(encoding="utf-8").splitlines() if line[:1] == "#"), ""
        )
        yield name, str(content.get("description") or content.get("summary") or comment)
