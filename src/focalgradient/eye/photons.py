"""Photon noise: number of quanta caught by the cones of a band from a surface of given luminance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, cast

from focalgradient.errors import check_fields
from focalgradient.eye.light import Band, band_light, band_sensitivity, illuminant, luminosity
from focalgradient.eye.ranges import check_pupil
from focalgradient.eye.wavefront import share_of_light
from focalgradient.quantities import Range

__all__ = ["Photons"]

LUMENS_PER_WATT = 683.0  # of monochromatic light at 540 THz: the definition of the candela
PLANCK_LIGHT = 6.62607015e-34 * 299792458.0  # J m: a quantum's energy times its wavelength


@dataclass(frozen=True, slots=True)
class Photons:
    """Mean luminance of a scene, and quantum efficiency of the cones.

    A surface of luminance L sends the spectral radiance E(l) with L = 683 lm/W x integral of E V dl. Through a pupil of
    area A, in the time t, from the solid angle w come A t w x integral of E l / (h c) dl quanta; a band catches each
    wavelength's by its sensitivity to quanta, times its efficiency at the peak. Their number varies by its square root.

    Parameters
    ----------
    luminance
        Mean luminance of the scene in cd/m^2.
    integration_time
        Integration time of the cones in seconds.
    efficiency
        Share of the quanta at the cornea caught by L and M cones at the wavelength of their peak: they cover most of
        the fovea, the media pass most of the light, and cones absorb about half of it.
    s_efficiency
        The same for S cones: a twentieth of the cones, behind media that absorb most of the blue light.
    illuminant
        Light that the surfaces, grey on average, reflect.

    Raises
    ------
    InputError
        If a number is not positive, or an efficiency above 1.

    Examples
    --------
    In daylight indoors, in a pixel of a minute of arc.

    >>> photons = Photons(luminance=100.0)
    >>> [round(photons.caught(band, 0.004, math.radians(1 / 60))) for band in ("L+M", "S")]
    [25124, 385]
    """

    luminance: Annotated[float, Range("cd/m^2", positive=True)]
    integration_time: Annotated[float, Range("seconds", positive=True)] = 0.2
    efficiency: Annotated[float, Range("shares", most=1, positive=True)] = 0.3
    s_efficiency: Annotated[float, Range("shares", most=1, positive=True)] = 0.01
    illuminant: str = "D65"

    def __post_init__(self) -> None:
        check_fields(self)

    def caught(self, band: str, pupil_diameter: float, pixel_angle: float, stiles_crawford: float = 0.0) -> float:
        """Return the mean number of quanta that a `band` catches from a square of `pixel_angle` (rad) by a pupil (m).

        With `stiles_crawford` (rho in 1/mm^2, see `Eye`) light through the rim of the pupil counts less.
        """
        check_pupil(pupil_diameter)
        nm = band_light(cast(Band, band), self.illuminant).wavelength_nm
        step = float(nm[1] - nm[0])
        energy = illuminant(nm, self.illuminant)
        radiance = self.luminance / (LUMENS_PER_WATT * float(energy @ luminosity(nm)) * step) * energy  # W / m^2 sr nm
        # To quanta, sensitivity is that to energy over the wavelength.
        seen = band_sensitivity(band, nm) / nm
        quanta = radiance * nm * 1e-9 / PLANCK_LIGHT @ (seen / seen.max()) * step
        share = self.s_efficiency if band == "S" else self.efficiency
        share *= share_of_light(pupil_diameter, stiles_crawford)
        return share * self.integration_time * math.pi / 4 * pupil_diameter**2 * pixel_angle**2 * float(quanta)
