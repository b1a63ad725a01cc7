"""Where on the Earth a recording was made, as options of an estimate."""

from __future__ import annotations

from typing import Any

from gfimu.array.gravity import local_gravity
from gfimu.base.errors import InputError
from gfimu.motion.earth import EarthRotation
from gfimu.recording import Recording

__all__ = ["place_options"]


def place_options(
    recording: Recording, latitude: float | None = None, north_rad: float | None = None
) -> dict[str, Any]:
    """Return the Earth's rotation and the gravity of a place, given or of the recording, as options of the estimate.

    Parameters
    ----------
    recording : Recording
        The recording, which may state ``latitude_deg``, ``north_rad`` and ``gravity_m_s2`` in its metadata.
    latitude : float, optional
        Latitude, degrees.
    north_rad : float, optional
        Direction of north from the world's x-axis, about up, rad.

    Raises
    ------
    InputError
        If there is a direction of north, and no latitude.
    """
    degrees = recording.metadata.get("latitude_deg") if latitude is None else latitude
    gravity = recording.metadata.get("gravity_m_s2") if latitude is None else None
    if degrees is None:
        if north_rad is not None:
            raise InputError("the direction of north has no use without a latitude; give that too (--latitude)")
        return {} if gravity is None else {"gravity": float(gravity)}
    north = float(recording.metadata.get("north_rad", 0.0)) if north_rad is None else north_rad
    return {
        "earth": EarthRotation(float(degrees), north),
        "gravity": local_gravity(float(degrees)) if gravity is None else float(gravity),
    }
