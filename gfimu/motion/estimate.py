"""The motion of a body at each sample of a recording, as `gfimu.estimate` finds it, and its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import OMEGA_PRODUCTS
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult, Series, axis_series
from gfimu.base.short_repr import joined
from gfimu.rate.result import undecided
from gfimu.recording.sample_times import timing
from gfimu.recording.tables.arrow import ArrowStream
from gfimu.recording.tables.column_file import open_columns, write_columns

__all__ = ["FORMAT_VERSION", "Estimate"]

FORMAT_VERSION = 1
_AXES = ("x", "y", "z")
_HEALTH = "health_"
_SIGN = "omega_sign_probability"
_VECTOR_COLUMNS: dict[str, tuple[str, ...]] = {
    "p": tuple(f"p_{axis}_m_s2" for axis in _AXES),
    "p_std": tuple(f"p_{axis}_std_m_s2" for axis in _AXES),
    "alpha": tuple(f"alpha_{axis}_rad_s2" for axis in _AXES),
    "alpha_std": tuple(f"alpha_{axis}_std_rad_s2" for axis in _AXES),
    "omega": tuple(f"omega_{axis}_rad_s" for axis in _AXES),
    "omega_std": tuple(f"omega_{axis}_std_rad_s" for axis in _AXES),
    "quaternion": ("q_w", "q_x", "q_y", "q_z"),
    "attitude_std": tuple(f"attitude_{axis}_std_rad" for axis in _AXES),
    "omega_products": tuple(f"omega_{pair}_rad2_s2" for pair in OMEGA_PRODUCTS),
    "omega_products_std": tuple(f"omega_{pair}_std_rad2_s2" for pair in OMEGA_PRODUCTS),
    "velocity": tuple(f"velocity_{axis}_m_s" for axis in _AXES),
    "velocity_std": tuple(f"velocity_{axis}_std_m_s" for axis in _AXES),
    "position": tuple(f"position_{axis}_m" for axis in _AXES),
    "position_std": tuple(f"position_{axis}_std_m" for axis in _AXES),
}
_OPTIONAL = ("p_std", "alpha_std", "attitude_std", "velocity", "velocity_std", "position", "position_std")
_ANGLE, _ANGLE_STD = "angle_rad", "angle_std_rad"


@dataclass(frozen=True)
class Estimate(PlottedResult):
    """Motion of the body at each sample of a recording; NaN where it could not be estimated.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Sample times, s.
    p : ndarray, shape (n, 3)
        Specific force of the body origin, body axes, m/s²; of a method that finds biases, without them.
    alpha : ndarray, shape (n, 3)
        Angular acceleration, body axes, rad/s²; likewise.
    omega, omega_std : ndarray, shape (n, 3)
        Angular rate and its standard deviation, body axes, rad/s: by noise as measured, biases, and errors of gains,
        axes and mounting as a calibration or the data sheets state them; enlarged where the channels disagree by more.
    quaternion : ndarray, shape (n, 4)
        Attitude (w, x, y, z), body to world.
    angle : ndarray, shape (n,)
        Angle turned about the table's axis since the first sample, rad, not wrapped.
    omega_products, omega_products_std : ndarray, shape (n, 6)
        Products of ω from the null space, in the order `gfimu.array.array.OMEGA_PRODUCTS`, and their standard
        deviation, rad²/s²; NaN where the array doesn't see one.
    velocity, position : ndarray, shape (n, 3), optional
        Velocity, m/s, and position, m, of the body origin in the world, where asked for.
    p_std, alpha_std, attitude_std, velocity_std, position_std : ndarray, shape (n, 3), optional
        Standard deviations, as of ω, of methods that follow the path; of the attitude about the axes of the world, rad:
        two of tilt and the heading, which counts from the start.
    angle_std : ndarray, shape (n,), optional
        Standard deviation of the angle, rad.
    health : mapping of str to ndarray, optional
        For each channel by name its health at each sample, shape (n,): 0 used, 1 excluded, 2 missing, 3 saturated,
        4 stuck, 5 in doubt (`gfimu.rate.health.fault.HealthCode`). None where the channels were not watched and all are
        used.
    sign_probability : ndarray, shape (n,), optional
        Probability that ``omega`` and not ``−omega`` is the rate; one half at rest. Where the method judges it.
    metadata : mapping
        Array, method, form, format and software version.

    Examples
    --------
    >>> import gfimu
    >>> estimate = gfimu.estimate(gfimu.simulate("paper_run", seed=1), rest_bias=True)
    >>> estimate.omega.shape
    (3000, 3)
    >>> estimate.to_pandas().columns[:3].tolist()
    ['t_s', 'p_x_m_s2', 'p_y_m_s2']
    """

    t_s: NDArray[np.float64]
    p: NDArray[np.float64]
    alpha: NDArray[np.float64]
    omega: NDArray[np.float64]
    omega_std: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    angle: NDArray[np.float64]
    omega_products: NDArray[np.float64]
    omega_products_std: NDArray[np.float64]
    velocity: NDArray[np.float64] | None = None
    position: NDArray[np.float64] | None = None
    p_std: NDArray[np.float64] | None = None
    alpha_std: NDArray[np.float64] | None = None
    attitude_std: NDArray[np.float64] | None = None
    angle_std: NDArray[np.float64] | None = None
    velocity_std: NDArray[np.float64] | None = None
    position_std: NDArray[np.float64] | None = None
    health: Mapping[str, NDArray[Any]] | None = None
    sign_probability: NDArray[np.float64] | None = None
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.t_s)

    def __repr__(self) -> str:
        names = [str(self.metadata[key]) for key in ("array", "method") if key in self.metadata]
        return joined(self, [*names, timing(self.t_s), "with position" if self.position is not None else ""])

    def _facts(self) -> list[tuple[str, str]]:
        facts = [(key, str(self.metadata[key])) for key in ("array", "method", "form") if key in self.metadata]
        known = np.flatnonzero(np.isfinite(self.omega).all(axis=1))
        facts.append(("samples", timing(self.t_s)))
        if known.size:
            last = known[-1]
            rate, std = (", ".join(f"{one:.4g}" for one in values[last]) for values in (self.omega, self.omega_std))
            facts += [("rate at the end", f"({rate}) rad/s"), ("its standard deviation", f"({std}) rad/s")]
        turned = self.angle[np.isfinite(self.angle)]
        if turned.size:
            facts.append(("angle turned", f"{turned[-1]:.5g} rad"))
        excluded = [name for name, health in (self.health or {}).items() if (health == 1).any()]
        return [*facts, ("channels excluded", ", ".join(excluded))] if excluded else facts

    def _notes(self) -> tuple[str, ...]:
        return tuple(str(one) for one in self.metadata.get("warnings", ()))

    def _panels(self) -> list[Panel]:
        panels = [
            Panel("angular rate", "ω, rad/s", axis_series(self.omega, self.omega_std), self.t_s),
            Panel("angular acceleration", "α, rad/s²", axis_series(self.alpha, self.alpha_std), self.t_s),
            Panel("specific force of the origin", "p, m/s²", axis_series(self.p, self.p_std), self.t_s),
            Panel(
                "angle about the table's axis", "angle, rad", (Series("", self.angle, std=self.angle_std),), self.t_s
            ),
        ]
        for title, label, values, std in (
            ("velocity in the world", "velocity, m/s", self.velocity, self.velocity_std),
            ("position in the world", "position, m", self.position, self.position_std),
        ):
            if values is not None:
                panels.append(Panel(title, label, axis_series(values, std), self.t_s))
        return panels

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns of the Estimate file, by name with unit."""
        columns: dict[str, NDArray[Any]] = {"t_s": self.t_s}
        for attribute, names in _VECTOR_COLUMNS.items():
            values = getattr(self, attribute)
            if values is not None:
                columns |= {name: values[:, index] for index, name in enumerate(names)}
        health = {f"{_HEALTH}{name}": values for name, values in (self.health or {}).items()}
        sign = {} if self.sign_probability is None else {_SIGN: self.sign_probability}
        angle = {_ANGLE: self.angle} | ({} if self.angle_std is None else {_ANGLE_STD: self.angle_std})
        return columns | sign | angle | health

    @property
    def sign_undecided(self) -> NDArray[np.bool_]:
        """Samples whose rate has a sign that is not decided, shape (n,)."""
        if self.sign_probability is None:
            return np.zeros(len(self), dtype=np.bool_)
        return undecided(self.sign_probability, self.omega, self.omega_std)

    def write(self, path: str | Path) -> None:
        """Write the Estimate file, ``.csv`` or ``.parquet``, whole or not at all."""
        write_columns(path, self.to_columns(), self.metadata)

    @classmethod
    def read(cls, path: str | Path | ArrowStream) -> Estimate:
        """Read an Estimate file, or a table object with its columns.

        Raises
        ------
        InputError
            If the file can't be read, lacks a column, or has another format version.
        """
        table = open_columns(path)
        version = table.metadata.get("format_version", FORMAT_VERSION)
        if version != FORMAT_VERSION:
            raise InputError(
                f"{table.file}: Estimate format {version}; this gfimu reads {FORMAT_VERSION}: estimate again"
            )
        absent = {attribute for attribute in _OPTIONAL if _VECTOR_COLUMNS[attribute][0] not in table.names}
        vectors = {attribute: names for attribute, names in _VECTOR_COLUMNS.items() if attribute not in absent}
        sign = [name for name in (_SIGN,) if name in table.names]
        turned = [name for name in (_ANGLE, _ANGLE_STD) if name in table.names or name == _ANGLE]
        watched = [name for name in table.names if name.startswith(_HEALTH)]
        wanted = ["t_s", *turned, *(name for names in vectors.values() for name in names), *sign, *watched]
        missing = [name for name in wanted if name not in table.names]
        if missing:
            raise InputError(f"{table.file}: column {missing[0]} is missing; give a file that gfimu estimate wrote")
        blocks = [np.column_stack(block) for block in table.blocks(wanted)]
        if not blocks:
            raise InputError(f"{table.file}: no samples below the header; estimate again")
        values = dict(zip(wanted, np.concatenate(blocks).T, strict=True))
        return cls(
            t_s=values["t_s"],
            angle=values[_ANGLE],
            angle_std=values.get(_ANGLE_STD),
            health={name.removeprefix(_HEALTH): values[name].astype(np.int8) for name in watched} or None,
            sign_probability=values[_SIGN] if sign else None,
            metadata=table.metadata,
            **{attribute: np.column_stack([values[name] for name in names]) for attribute, names in vectors.items()},
        )
