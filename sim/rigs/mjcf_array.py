"""Arrays from the sites of a MuJoCo model: each site is a sensing axis, along the site's x axis."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from gfimu.array.array import AccelerometerArray, Chip
from gfimu.array.array_file import CHIP_NAME
from gfimu.base.errors import InputError, unknown_name
from gfimu.base.files.input_file import check_input
from gfimu.base.files.memory import MemoryLimit
from sim.rigs.mjcf_size import check_mjcf_size
from sim.rigs.mujoco_warnings import mujoco_warnings

__all__ = ["array_from_mjcf"]

_TETRAHEDRON = (0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1)  # in place of a mesh, m
_USER_NUMBERS = ("body", "jnt", "geom", "site", "cam", "tendon", "actuator", "sensor")
_SAME_PLACE = 1e-6  # sites nearer than this belong to one chip, m


def array_from_mjcf(path: str | Path, *, body: str | None = None, sites: str = "*") -> AccelerometerArray:
    """Read an accelerometer array from the sites of an MJCF file.

    Sites at one point make one chip; a chip has up to three sensing axes, in the order of the compiled
    model: a body's own sites before those of its children.

    Parameters
    ----------
    path : str or Path
        MJCF file.
    body : str, optional
        Body whose frame is the array's; by default the one that carries all the sites, nearest to them.
    sites : str
        Pattern of the names of the sites that are sensing axes, such as ``"a??"``.

    Raises
    ------
    InputError
        If the file can't be read, holds no such body or no such site, sites without a finite place, or more than three
        that share a point.
    """
    file = check_input(path)
    check_mjcf_size(file)
    try:
        with mujoco_warnings(str(file)), MemoryLimit.of(file).enforced():
            model = _bare(mujoco.MjSpec.from_file(str(file))).compile()
    except (ValueError, RuntimeError, MemoryError) as error:
        raise InputError(f"{file}: not a valid MJCF model ({' '.join(str(error).split())})") from None
    names = [model.site(i).name for i in range(model.nsite)]
    wanted = [i for i, name in enumerate(names) if name and fnmatch.fnmatchcase(name, sites)]
    if not wanted:
        found = f"it has {', '.join(name for name in names if name)}" if any(names) else "it has no named site"
        raise InputError(f"{file}: no site named {sites!r}; {found}: add one site per sensing axis, x along the axis")
    frame = _frame_body(model, file, body, wanted)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    to_body = data.xmat[frame].reshape(3, 3).T
    positions = (data.site_xpos[wanted] - data.xpos[frame]) @ to_body.T
    axes = data.site_xmat[wanted].reshape(-1, 3, 3)[:, :, 0] @ to_body.T
    bad = [names[wanted[row]] for row in np.flatnonzero(~np.isfinite(np.hstack([positions, axes])).all(axis=1))]
    if bad:
        raise InputError(f"{file}: site {bad[0]} has no finite place or axis; correct the numbers of it and its bodies")
    # Compiled rotations carry rounding errors of 1e-17; on axes along the body's they would only disturb readers.
    positions, axes = np.round(positions, 12) + 0.0, np.round(axes, 12) + 0.0
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    chips: list[list[int]] = []
    for i in range(len(wanted)):
        near = [chip for chip in chips if np.linalg.norm(positions[chip[0]] - positions[i]) < _SAME_PLACE]
        if near:
            near[0].append(i)
        else:
            chips.append([i])
    site_names = [names[i] for i in wanted]
    return AccelerometerArray(
        name=file.stem,
        chips=tuple(
            _chip(file, number, [site_names[i] for i in chip], positions[chip[0]], axes[chip])
            for number, chip in enumerate(chips, start=1)
        ),
        length_unit=float(np.abs(positions).max()) or 1.0,
        description=f"sites {sites} of {file.name}, in the frame of body {model.body(frame).name or 'world'}",
    )


def _bare(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Leave the sites alone: files of meshes and pictures are not read, memory that the model asks for is not taken."""
    for mesh in spec.meshes:
        mesh.file, mesh.uservert = "", _TETRAHEDRON
    for texture in spec.textures:
        texture.file, texture.builtin = "", mujoco.mjtBuiltin.mjBUILTIN_FLAT
        texture.cubefiles = [""] * len(texture.cubefiles)
        texture.width = texture.height = 1
    for field in spec.hfields:
        field.file, field.nrow, field.ncol, field.userdata = "", 2, 2, [0.0, 0.0, 0.0, 1.0]
    for skin in list(spec.skins):
        spec.delete(skin)
    spec.nkey = spec.nuserdata = 0
    spec.memory = spec.njmax = spec.nconmax = spec.nstack = -1
    for kind in _USER_NUMBERS:
        setattr(spec, f"nuser_{kind}", -1)
    return spec


def _chip(file: Path, number: int, names: Sequence[str], position: np.ndarray, axes: np.ndarray) -> Chip:
    """Build a chip from the sites at one point, named by what their names share."""
    if len(names) > 3:
        raise InputError(f"{file}: sites {', '.join(names)} share a point; a chip has at most three sensing axes")
    stem = names[0][:-1]
    regular = list(names) == [f"{stem}{axis}" for axis in range(1, len(names) + 1)]
    return Chip(stem if regular and stem and re.fullmatch(CHIP_NAME, stem) else f"a{number}", position, axes)


def _frame_body(model: mujoco.MjModel, file: Path, body: str | None, sites: Sequence[int]) -> int:
    """Return the body whose frame is the array's."""
    if body is not None:
        names = [model.body(i).name for i in range(model.nbody)]
        if body not in names:
            raise unknown_name(f"body of {file}", body, [name for name in names if name])
        return names.index(body)
    lines = [_ancestors(model, int(model.site_bodyid[site])) for site in sites]
    return next(candidate for candidate in lines[0] if all(candidate in line for line in lines))


def _ancestors(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the body and all it hangs on, the nearest first."""
    line = [body]
    while line[-1]:
        line.append(int(model.body_parentid[line[-1]]))
    return line
