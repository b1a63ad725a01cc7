"""A twin with a few effects in its library: a search of it takes half a second."""

from __future__ import annotations

from dataclasses import dataclass

from sim.twin import Twin


@dataclass(frozen=True)
class FewEffects(Twin):
    """A twin whose library has a few effects only."""

    few: tuple[str, ...] = ()

    def families(self):
        library = super().families()
        return {name: library[name] for name in self.few}


def having(twin, *few):
    """The twin with a few effects in its library."""
    return FewEffects(array=twin.array, array_name=twin.array_name, sample_rate=twin.sample_rate, few=few)
