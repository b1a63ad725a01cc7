"""The place on the Earth where a recording was made, as commands and functions take it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.commands.shell.declare import Group, Option
from gfimu.commands.shell.options import LATITUDE

if TYPE_CHECKING:
    from gfimu.recording import Recording

__all__ = ["PLACE", "Place"]


@dataclass(frozen=True)
class Place:
    """A place on the Earth; what is None is the recording's own.

    Parameters
    ----------
    latitude : float, optional
        Latitude, degrees (metadata ``latitude_deg``).
    north_rad : float, optional
        Direction of north from the world's x-axis (for a levelled body: from its own at the start), about up, rad
        (metadata ``north_rad``, or 0).

    Examples
    --------
    >>> import gfimu
    >>> gfimu.estimate("run.parquet", place=gfimu.Place(52.0, north_rad=0.5))  # doctest: +SKIP
    """

    latitude: Annotated[float | None, LATITUDE.also(": the Earth's rotation and the local gravity from it")] = None
    north_rad: Annotated[
        float | None, Option("With --latitude: north from the x-axis at the start, about up, rad; else 0.", "RAD")
    ] = None

    def of(self, recording: "Recording") -> dict[str, Any]:
        """Return the Earth's rotation and the gravity there as options of the estimate; none without a place.

        Raises
        ------
        InputError
            If north is known and the latitude is not.
        """
        from gfimu.motion.place import place_options

        return place_options(recording, self.latitude, self.north_rad)


PLACE = Group(
    Place,
    "Where on the Earth the body is, such as ``gfimu.Place(52.0, north_rad=0.5)``: the Earth's rotation and the local "
    "gravity from it are taken into account. By default the recording's own place, or none.",
)
"""The latitude and the direction of north."""
