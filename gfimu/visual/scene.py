"""The 3-D scene of a recording: bodies made of boxes, meshes, arrows and names that turn and move over time.

Geometry comes as plain arrays, so that a MuJoCo model, a drawing or nothing but the array file can supply it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.base.results.colours import Colour, chip_colour
from gfimu.visual.colours import BACKGROUND, METAL, TABLE

__all__ = ["Body", "Box", "Cylinder", "Mesh", "Names", "Path", "Pointers", "Scene", "SensingArrows", "Shape"]

TIMELINE = "time"
"""Name of the timeline: time on the board's clock, s."""

_MOST_POSES = 20_000  # poses of a body in one file; longer runs are thinned evenly, their plots are not
_SIDES = 96  # of a cylinder


@dataclass(frozen=True)
class Box:
    """A box in its body's frame: half sizes and centre, m, shape (3,); quaternion (w, x, y, z)."""

    half_size: Sequence[float]
    centre: Sequence[float] = (0.0, 0.0, 0.0)
    quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0)
    colour: Colour = METAL
    wireframe: bool = False
    label: str = ""


@dataclass(frozen=True)
class Cylinder:
    """A cylinder along z in its body's frame: radius, length and centre, m; quaternion (w, x, y, z)."""

    radius: float
    length: float
    centre: Sequence[float] = (0.0, 0.0, 0.0)
    quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0)
    colour: Colour = TABLE


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh in its body's frame: vertices (v, 3), m; triangles (f, 3), vertex indices."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.integer]
    colour: Colour = METAL


@dataclass(frozen=True)
class Pointers:
    """Arrows in their body's frame: starts and vectors (k, 3), m; a colour and a name for each, and their radius, m."""

    origins: NDArray[np.float64]
    vectors: NDArray[np.float64]
    colours: Sequence[Colour]
    labels: Sequence[str]
    radius: float
    show_labels: bool = True


@dataclass(frozen=True)
class Names:
    """Names in their body's frame: places (k, 3), m, texts, and a colour for each."""

    places: NDArray[np.float64]
    texts: Sequence[str]
    colours: Sequence[Colour]


Shape = Box | Cylinder | Mesh | Pointers | Names


@dataclass(frozen=True)
class Path:
    """Pose of a body over time in the world.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time, s.
    quaternion : ndarray, shape (n, 4)
        Attitude (w, x, y, z), body to world.
    position : ndarray, shape (n, 3) or (3,)
        Position of the body's origin, m.
    """

    t: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    position: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class SensingArrows:
    """One arrow per sensing axis, at its chip, as long as its reading.

    Parameters
    ----------
    array : AccelerometerArray
        Geometry, with c channels.
    t : ndarray, shape (n,)
        Time, s.
    readings : ndarray, shape (n, c)
        Reading of each channel, m/s².
    length_per_m_s2 : float
        Length drawn for 1 m/s², m.
    radius : float
        Of the arrows, m.
    colour : Colour, optional
        One colour for all arrows; each chip's own otherwise.
    """

    array: AccelerometerArray
    t: NDArray[np.float64]
    readings: NDArray[np.float64]
    length_per_m_s2: float
    radius: float
    colour: Colour | None = None


@dataclass(frozen=True)
class Body:
    """A rigid body: its shapes and, where it moves, its path and the sets of arrows it carries."""

    name: str
    shapes: Sequence[Shape]
    path: Path | None = None
    arrows: Sequence[SensingArrows] = ()


@dataclass(frozen=True)
class Scene:
    """Bodies in a world with z up, and where to look at them from.

    Parameters
    ----------
    bodies : sequence of Body
        Their names become entity paths.
    eye, look_at : sequence of float, shape (3,)
        Position of the eye and the point it looks at, m.
    grid_spacing : float
        Distance of the lines on the ground, m.
    """

    bodies: Sequence[Body]
    eye: Sequence[float] = (0.27, -0.25, 0.22)
    look_at: Sequence[float] = (0.0, 0.0, 0.04)
    grid_spacing: float = 0.05

    def log(self, stream: rr.RecordingStream) -> None:
        """Write the bodies, their paths and their arrows to a rerun stream."""
        stream.log("scene", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for body in self.bodies:
            entity = f"scene/{body.name}"
            for number, shape in enumerate(body.shapes):
                stream.log(f"{entity}/shape_{number}", _archetype(shape), static=True)
            if body.path is not None:
                _log_path(stream, entity, body.path)
            for number, arrows in enumerate(body.arrows):
                _log_arrows(stream, f"{entity}/sensing_axes_{number}", arrows)

    def view(self, name: str) -> rrb.Spatial3DView:
        """Return the 3-D view of the scene for a blueprint."""
        return rrb.Spatial3DView(
            origin="/scene",
            name=name,
            background=list(BACKGROUND),
            line_grid=rrb.LineGrid3D(spacing=self.grid_spacing, color=[90, 96, 104, 60]),
            eye_controls=rrb.EyeControls3D(
                kind=rrb.Eye3DKind.Orbital, position=list(self.eye), look_target=list(self.look_at), eye_up=[0, 0, 1]
            ),
        )


def _archetype(shape: Shape) -> rr.Boxes3D | rr.Mesh3D | rr.Arrows3D | rr.Points3D:
    match shape:
        case Box():
            return rr.Boxes3D(
                half_sizes=[shape.half_size],
                centers=[shape.centre],
                quaternions=[_xyzw(shape.quaternion)],
                colors=[shape.colour],
                radii=[0.015 * max(shape.half_size)] if shape.wireframe else None,
                labels=[shape.label] if shape.label else None,
                show_labels=False if shape.label else None,  # the chips' names stand beside them
                fill_mode="MajorWireframe" if shape.wireframe else "Solid",
            )
        case Cylinder():
            vertices, triangles = _cylinder_mesh(shape)
            return rr.Mesh3D(vertex_positions=vertices, triangle_indices=triangles, albedo_factor=shape.colour)
        case Pointers():
            return rr.Arrows3D(
                origins=shape.origins,
                vectors=shape.vectors,
                colors=shape.colours,
                radii=[shape.radius],
                labels=list(shape.labels) or None,
                show_labels=shape.show_labels if shape.labels else None,
            )
        case Names():
            return rr.Points3D(
                shape.places, colors=shape.colours, radii=[0.0], labels=list(shape.texts), show_labels=True
            )
        case Mesh():
            return rr.Mesh3D(
                vertex_positions=shape.vertices, triangle_indices=shape.triangles, albedo_factor=shape.colour
            )


def _cylinder_mesh(shape: Cylinder) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices and triangles of a cylinder; rerun's own cylinder has so few sides that a table looks like a nut."""
    angle = np.linspace(0.0, 2 * np.pi, _SIDES, endpoint=False)
    ring = np.column_stack([shape.radius * np.cos(angle), shape.radius * np.sin(angle), np.zeros(_SIDES)])
    up = np.array([0.0, 0.0, shape.length / 2])
    # Sides and caps have their own vertices, so that the rim is shaded as an edge.
    vertices = np.concatenate([ring - up, ring + up, ring - up, ring + up, [-up, up]])
    this = np.arange(_SIDES)
    following = (this + 1) % _SIDES
    low, high = 4 * _SIDES + np.zeros((2, _SIDES), dtype=np.int64) + np.array([[0], [1]])
    triangles = np.concatenate(
        [
            np.column_stack([this, following, this + _SIDES]),
            np.column_stack([following, following + _SIDES, this + _SIDES]),
            np.column_stack([low, following + 2 * _SIDES, this + 2 * _SIDES]),
            np.column_stack([high, this + 3 * _SIDES, following + 3 * _SIDES]),
        ]
    )
    turned = Rotation.from_quat(np.asarray(shape.quaternion, dtype=float), scalar_first=True).apply(vertices)
    return turned + np.asarray(shape.centre, dtype=float), triangles


def _xyzw(quaternion: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """Reorder (w, x, y, z) to rerun's (x, y, z, w)."""
    return np.roll(np.asarray(quaternion, dtype=float), -1, axis=-1)


def _thinned(n: int) -> slice:
    return slice(None, None, max(1, -(-n // _MOST_POSES)))


def _log_path(stream: rr.RecordingStream, entity: str, path: Path) -> None:
    position = np.broadcast_to(path.position, (len(path.t), 3))
    complete = np.flatnonzero(np.isfinite(path.quaternion).all(axis=1) & np.isfinite(position).all(axis=1))
    keep = complete[_thinned(len(complete))]
    stream.send_columns(
        entity,
        [rr.TimeColumn(TIMELINE, duration=path.t[keep])],
        rr.Transform3D.columns(translation=position[keep], quaternion=_xyzw(path.quaternion[keep])),
    )


def _log_arrows(stream: rr.RecordingStream, entity: str, arrows: SensingArrows) -> None:
    array = arrows.array
    keep = _thinned(len(arrows.t))
    t = arrows.t[keep]
    lengths = np.nan_to_num(arrows.readings[keep]) * arrows.length_per_m_s2  # (n, c)
    vectors = lengths[:, :, None] * array.axes  # (n, c, 3)
    chips = [chip_colour(int(chip)) for chip in array.chip_of_channel]
    still = rr.Arrows3D.from_fields(
        origins=array.positions,
        colors=chips if arrows.colour is None else [arrows.colour],
        radii=[arrows.radius],
        labels=list(array.channels),
        show_labels=False,
    )
    stream.log(entity, still, static=True)
    stream.send_columns(
        entity,
        [rr.TimeColumn(TIMELINE, duration=t)],
        rr.Arrows3D.columns(vectors=vectors.reshape(-1, 3)).partition(np.full(len(t), array.n_channels)),
    )
