"""Effects that no method can tell apart in a recording, by what each leaves of the other: data, no engine's verdict.

The signature of a hidden effect is its noise-free change of channels and tachometer in the true motion, in units of
their white noise. A rival is fitted to it together with the motion of the table, which no method knows exactly; the
norm of what remains is the d′ by which an ideal observer could tell the two apart. Below `LEAST_SEPARABLE` they are
tied: the log likelihood ratio has mean d′²/2 and standard deviation d′ (Kay, Detection Theory, 1998, section 4.3.2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from sim.effects import Effect, make_effect
from sim.motions.motion import SpinMotion
from sim.trials.benchmark.library import motion_columns
from sim.trials.benchmark.world import World
from sim.trials.worlds.hidden import FORMLESS
from sim.twin import Twin

__all__ = ["LEAST_SEPARABLE", "free_distance_and_ties"]

Floats = NDArray[np.float64]

LEAST_SEPARABLE = 3.0
"""d′ below which two effects are tied; the log odds of an ideal observer are 4.5 ± 3 there."""

_KNOTS_S = 0.25  # distance of the knots of the unknown motion
_SINGULAR = 1e-10  # numerical: singular values below this share count as zero
_STEP = 0.02  # finite difference as a share of the prior's standard deviation
_SCANNED = frozenset({"interference_tone"})  # its frequency is not on a grid, and no other effect is a tone


class _Observer:
    """Signatures in one motion, in units of the white noise, with the motion of the table projected out."""

    def __init__(self, twin: Twin, motion: SpinMotion, t: Floats, temperature: Floats, tacho_noise: float) -> None:
        self._twin, self._motion, self._t, self._temperature = twin, motion, t, temperature
        self._tacho_noise = tacho_noise
        self._white = twin.expected_noise(1.0 / float(np.median(np.diff(t)))).white
        self._nominal = self._predict(())
        channels = self._nominal.reshape(len(t), -1)[:, :-1]
        self._moves = motion_columns(motion, t, channels, tacho_noise, _KNOTS_S)
        self._motion_gram = cho_factor((self._moves.T @ self._moves).toarray())

    def signature(self, effect: Effect) -> Floats:
        """Return the change by an effect, (n (c + 1),), without what another motion of the table would do as well."""
        change = self._predict((effect,)) - self._nominal
        return np.asarray(change - self._moves @ cho_solve(self._motion_gram, self._moves.T @ change))

    def left_by(self, family: type[Effect], shape: dict[str, float], signatures: Floats) -> Floats:
        """Return the norm of what a kind of effect at a shape leaves of each signature, (n (c + 1), k) to (k,)."""
        columns = self._columns(family, shape)
        along = self._moves.T @ columns  # the signatures have nothing along the motion
        gram = columns.T @ columns - along.T @ cho_solve(self._motion_gram, along)
        score = columns.T @ signatures
        explained = np.einsum("mk,mk->k", score, np.linalg.pinv(gram, rcond=_SINGULAR, hermitian=True) @ score)
        return np.sqrt(np.maximum(np.einsum("nk,nk->k", signatures, signatures) - explained, 0.0))

    def _columns(self, family: type[Effect], shape: dict[str, float]) -> Floats:
        """Return the derivative by each size of a kind of effect, (n (c + 1), m)."""
        array, sizes = self._twin.array, family.sizes(self._twin.array)
        found = []
        for index, size in enumerate(sizes):
            values = np.zeros(len(sizes))
            values[index] = _STEP * size.prior_std
            found.append((self._predict((family.from_sizes(array, values, shape),)) - self._nominal) / _STEP)
        return np.column_stack(found)

    def _predict(self, effects: tuple[Effect, ...]) -> Floats:
        channels, reference = self._twin.predict(self._motion, self._t, effects=effects, temperature=self._temperature)
        return np.column_stack([channels / self._white, reference / self._tacho_noise]).ravel()


def free_distance_and_ties(world: World, tacho_noise: float, least: float) -> tuple[float, dict[str, tuple[str, ...]]]:
    """Return what can be seen of hidden effects of the library, and with which others each is tied.

    Parameters
    ----------
    world : World
        A world whose hidden effects are of the library.
    tacho_noise : float
        White noise of the tachometer, rad/s.
    least : float
        d′ below which no ties are looked for.

    Returns
    -------
    float
        d′ of the least hidden effect with the motion of the table unknown; NaN where none has a noise-free form.
    dict
        Names of tied effects by hidden effect; without those that have none.
    """
    twin, recording = world.task.twin, world.task.recording
    effects = [make_effect(name, parameters) for name, parameters in world.truth.hidden if name not in FORMLESS]
    if not effects:
        return float("nan"), {}
    warm = recording.reference["temperature_degC"]
    observer = _Observer(twin, world.motion, recording.t_s, warm, tacho_noise)
    signatures = np.column_stack([observer.signature(effect) for effect in effects])
    seen = float(np.linalg.norm(signatures, axis=0).min())
    ties: dict[str, list[str]] = {one.name: [] for one in effects}
    for rival, family in twin.families().items() if seen >= least else ():
        if rival in _SCANNED | FORMLESS or not family.sizes(twin.array):
            continue
        shapes = family.shapes(recording.duration, recording.sample_rate)
        left = np.min([observer.left_by(family, shape, signatures) for shape in shapes], axis=0)
        for name, remains in zip(ties, left, strict=True):
            if name != rival and remains < LEAST_SEPARABLE:
                ties[name].append(rival)
    return seen, {name: tuple(rivals) for name, rivals in ties.items() if rivals}
