"""From latitude and longitude to local metres north and east."""

import numpy as np

from ..physics.motion import Array

SEMI_MAJOR_AXIS = 6378137.0
"""Of the WGS 84 ellipsoid [m] (NGA.STND.0036, table 3.1)."""
FLATTENING = 1.0 / 298.257223563
"""Of the WGS 84 ellipsoid (NGA.STND.0036, table 3.1)."""


def local_metres(latitude: Array, longitude: Array) -> tuple[Array, Array, tuple[float, float]]:
    """Metres north and east of the first fix, in the tangent plane of the WGS 84 ellipsoid there.

    The fix, at height zero, is taken to earth-centred axes and turned into the north and east of the first one (Fossen
    2021, chapter 2, ECEF and NED axes); nothing is linearised. The plane leaves the surface: the distance to a point
    10 km off comes out 4 mm too short.

    Parameters
    ----------
    latitude, longitude : (n,) [deg]; a fix that is not finite stays without a number

    Returns
    -------
    (north, east, origin) : (n,) [m], (n,) [m], and latitude and longitude of the first finite fix [deg]; the origin is
        not a number when there is no fix.

    Examples
    --------
    One minute of latitude is about a nautical mile:

    >>> north, east, origin = local_metres(np.array([60.0, 60.0 + 1.0 / 60.0]), np.array([10.0, 10.0]))
    >>> float(north[1].round(1)), float(abs(east[1]).round(6)), origin
    (1856.9, 0.0, (60.0, 10.0))
    """
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if not known.size:
        return np.full(latitude.shape, np.nan), np.full(latitude.shape, np.nan), (np.nan, np.nan)
    origin = float(latitude[known[0]]), float(longitude[known[0]])
    phi, across = np.radians(latitude), np.radians(longitude - origin[1])
    start = np.radians(origin[0])
    # Earth-centred axes turned by the origin's longitude, so that east is the second axis: no loss by cancellation.
    reach, height = _meridian(phi)
    first_reach, first_height = _meridian(start)
    outward = reach * np.cos(across) - first_reach
    north = np.cos(start) * (height - first_height) - np.sin(start) * outward
    return np.asarray(north, float), np.asarray(reach * np.sin(across), float), origin


def _meridian(phi: Array | np.floating) -> tuple[Array, Array]:
    """Distance from the axis and from the equator's plane [m] of the ellipsoid's surface at latitude `phi` [rad]."""
    squared = FLATTENING * (2.0 - FLATTENING)
    normal = SEMI_MAJOR_AXIS / np.sqrt(1.0 - squared * np.sin(phi) ** 2)
    return normal * np.cos(phi), normal * (1.0 - squared) * np.sin(phi)
