"""Optics of an eye at one wavelength and one moment, with the interface of a lens.

The plane of focus has the vergence (accommodation) - (chromatic difference of refraction), and blur follows from it as
for any lens: a disc of angular radius (pupil / 2) x |defocus|. An eye at two moments, or in two wavelengths, is two
`Eye` objects; a view carries either, and the depth core treats it as any other.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, check_finite, check_number
from focalgradient.eye.chromatic import REFERENCE_NM, chromatic_difference
from focalgradient.eye.clear_pupil import wave_transfer
from focalgradient.eye.measured import resized_zernike, zernike_terms
from focalgradient.eye.prescription import PersonalOptics
from focalgradient.eye.ranges import Pupil as PupilDiameter
from focalgradient.eye.ranges import Vergence, Wavelength, check_pupil, ordered_times
from focalgradient.eye.refraction import Correction, Refraction
from focalgradient.eye.through_focus import through_focus
from focalgradient.eye.wavefront import Aberrations, Pupil, added_terms, check_aberrations, defocus_term
from focalgradient.eye.zones import ZonedLens
from focalgradient.optics import Side, defocus_at, distance_of_blur
from focalgradient.quantities import Range

__all__ = ["Eye", "TimeCourse"]

LARGEST_OFFSET = 2e-3
"""Maximum offset of the pupil in metres: real pupils are better centred, and values in millimetres are rejected."""


class TimeCourse(Protocol):
    """Deviation of accommodation from its mean over time, in dioptres: an `Oscillation`, or `Microfluctuations`."""

    def at(self, times: ArrayLike) -> FloatArray:
        """Return the change of accommodation in dioptres at `times` (s)."""


@dataclass(frozen=True, slots=True, init=False)
class Eye:
    """Optics of an eye in light of one wavelength at one moment.

    An eye is given by its pupil and focus, ``Eye(0.004, 1.0)``, or by data of a person,
    ``Eye(refraction="-2.00 -0.75 x 180", age=30, looking_at=2.5)``, from which pupil, focus and astigmatism follow.

    Parameters
    ----------
    pupil_diameter
        Diameter in metres, from 0.1 to 9 mm. Without it, a person's pupil is the natural one (`natural_pupil`).
    accommodation
        Vergence in dioptres of the plane in focus at the reference wavelength, 580 nm: 0 at infinity. A person's
        follows from `refraction`, `correction` and `looking_at` or `response`.
    wavelength_nm
        Wavelength of the light, 380 to 780 nm.
    chromatic_scale
        An individual's chromatic aberration as a multiple of the mean eye's: 0 is an eye without it.
    aberrations
        Further aberrations, as Zernike terms ``(n, m, micrometres)`` over this pupil (OSA standard), x to the right and
        y down as in the image; included by `focalgradient.eye.blur_transfer`, but not by discs and Gaussians. A
        person's astigmatism is added to them.
    stiles_crawford
        Stiles-Crawford coefficient rho in 10^(-rho r^2), in 1/mm^2: about 0.05 in the fovea.
    pupil_offset
        Offset of the pupil's centre from the visual axis in metres, x to the right and y down: it causes transverse
        chromatic aberration, an angle of the offset times the chromatic difference (`chromatic_shift`). Its mean is 0,
        and it is below 0.5 mm in most eyes (Rynders, Lidkea, Chisholm & Thibos 1995).
    lens
        A multifocal lens or one of extended depth of focus, in zones (`ZonedLens`), which waves show and discs do not.
    refraction
        Prescription 12 mm before the cornea: `Refraction`, or text such as "-2.00 -0.75 x 180" or "plano". Plano, if
        only `age` is given.
    age
        Years, from which follow the amplitude of accommodation (`accommodation_amplitude`) and the natural pupil;
        without it, accommodation has no limit, and the natural pupil is of 28.58 years.
    looking_at
        Vergence in dioptres that the eye accommodates to, 0 by default: in the mean of all meridians, without lag, and
        no further than its age allows, nor beyond its relaxed state.
    response
        Instead of `looking_at`: dioptres by which the eye accommodates beyond its relaxed state.
    correction
        Worn before the eye: `Correction`, or the name of one of `CORRECTIONS`, "none" by default, "spectacles" or
        "contact-lens", which correct fully.
    luminance, field_deg
        Adapting field of the natural pupil: cd/m^2 (100 by default), and diameter in degrees (20).

    Raises
    ------
    InputError
        If a number is out of its range, something is missing, or two arguments contradict each other.

    Examples
    --------
    Accommodated to 1 m in yellow light, the same eye focuses blue light from nearer.

    >>> eye = Eye(pupil_diameter=0.004, accommodation=1.0)
    >>> blue = eye.in_light(450)
    >>> eye.focus_vergence, round(blue.focus_vergence, 3)
    (1.0, 1.954)
    >>> round(float(eye.blur_radius(0.5) - blue.blur_radius(0.5)), 6)  # an object at 0.5 m is sharper in blue
    0.001908

    The relaxed eye of a myope is focused at 43 cm; a myope of 60 years in spectacles looks at 40 cm in vain.

    >>> myope = Eye(refraction="-2.00 -0.75 x 180", age=30, pupil_diameter=0.004)
    >>> round(myope.focus_vergence, 2), [(n, m, round(c, 3)) for n, m, c in myope.aberrations]
    (2.31, [(2, 2, -0.289)])
    >>> old = Eye(refraction="-2.00", age=60, looking_at=2.5, correction="spectacles")
    >>> round(old.focus_vergence, 2), round(1e3 * old.pupil_diameter, 2)
    (0.11, 3.33)
    """

    pupil_diameter: PupilDiameter
    accommodation: Vergence
    wavelength_nm: Wavelength = REFERENCE_NM
    chromatic_scale: Annotated[float, Range("multiples of the mean eye's aberration", 0)] = 1.0
    aberrations: Aberrations = ()
    stiles_crawford: Annotated[float, Range("1/mm^2", 0)] = 0.0
    pupil_offset: Annotated[tuple[float, float], Range("metres, x and y", -LARGEST_OFFSET, LARGEST_OFFSET)] = (0.0, 0.0)
    lens: ZonedLens | None = None

    # Written out, as a person's arguments are not fields: only the derived values are kept.
    def __init__(
        self,
        pupil_diameter: float | None = None,
        accommodation: float | None = None,
        wavelength_nm: float = REFERENCE_NM,
        chromatic_scale: float = 1.0,
        aberrations: Aberrations = (),
        stiles_crawford: float = 0.0,
        pupil_offset: tuple[float, float] = (0.0, 0.0),
        lens: ZonedLens | None = None,
        *,
        refraction: Refraction | str | None = None,
        age: float | None = None,
        looking_at: float | None = None,
        response: float | None = None,
        correction: Correction | str | None = None,
        luminance: float | None = None,
        field_deg: float | None = None,
    ) -> None:
        person = PersonalOptics(refraction, age, looking_at, response, correction, luminance, field_deg)
        if not person.has_optics:
            if pupil_diameter is None or accommodation is None or any(part is not None for part in person):
                _refuse_unprescribed(pupil_diameter, person)
        else:
            if accommodation is not None:
                name = "age" if refraction is None else "refraction"
                raise InputError(
                    f"accommodation and {name} are both given, but accommodation is the vergence in focus of an eye "
                    "that has neither a refraction nor an age: give looking_at or response instead."
                )
            pupil_diameter, accommodation, aberrations = person.prescribed(pupil_diameter, aberrations)
        given = dict(locals())
        for field in fields(Eye):
            object.__setattr__(self, field.name, given[field.name])
        check_aberrations(self.aberrations)
        check_fields(self)

    @classmethod
    def from_zernike(
        cls,
        coefficients_um: ArrayLike,
        pupil_diameter: float,
        *,
        measured_diameter: float | None = None,
        measured_nm: float = REFERENCE_NM,
        accommodation: float = 0.0,
        wavelength_nm: float = REFERENCE_NM,
        chromatic_scale: float = 1.0,
        stiles_crawford: float = 0.0,
    ) -> Eye:
        """Return the eye of a measured wavefront.

        Parameters
        ----------
        coefficients_um
            Zernike coefficients in micrometres, in the order of the OSA (ANSI Z80.28) from piston on. Piston and tilts
            are left out. Defocus c(2, 0), which is positive in a myopic eye, becomes vergence in focus:
            16 sqrt(3) c / d^2 dioptres, d in mm. The standard's x and y go to the right and up as the examiner sees the
            eye, to the left and up for who looks through it; so terms of odd n change their sign for the image's axes.
        pupil_diameter
            Diameter of the eye's pupil in metres.
        measured_diameter
            Diameter in metres of the pupil of the coefficients: `pupil_diameter` by default, never smaller.
        measured_nm
            Wavelength of the measurement in nm.
        accommodation
            Dioptres beyond the state in which the eye was measured.
        wavelength_nm, chromatic_scale, stiles_crawford
            As for `Eye`.

        Raises
        ------
        InputError
            If a number is out of its range, or the pupil is larger than the measured one.

        Examples
        --------
        A myopic eye of half a dioptre with spherical aberration, measured over 6 mm; over 4 mm, where that aberration
        is a fifth, a part of it acts as defocus.

        >>> eye = Eye.from_zernike([0, 0, 0, 0, 0.65, 0, 0, 0, 0, 0, 0, 0, 0.1], 0.004, measured_diameter=0.006)
        >>> round(eye.focus_vergence, 3), [(n, m, round(c, 4)) for n, m, c in eye.aberrations]
        (0.335, [(4, 0, 0.0198)])
        """
        check_pupil(pupil_diameter)
        whole = pupil_diameter if measured_diameter is None else measured_diameter
        check_pupil(whole)
        terms = resized_zernike(zernike_terms(coefficients_um), pupil_diameter / whole)
        defocus = sum(c for n, m, c in terms if (n, m) == (2, 0)) * 16 * np.sqrt(3) / (1e3 * pupil_diameter) ** 2
        in_light = chromatic_scale * float(chromatic_difference(measured_nm))
        return cls(
            pupil_diameter,
            accommodation + float(defocus) + in_light,
            wavelength_nm,
            chromatic_scale,
            tuple((n, m, -c if n % 2 else c) for n, m, c in terms if n > 1 and (n, m) != (2, 0)),
            stiles_crawford,
        )

    @property
    def aperture_diameter(self) -> float:
        """Diameter of the pupil in metres."""
        return self.pupil_diameter

    @property
    def focus_vergence(self) -> float:
        """Vergence in dioptres of the plane in focus: higher in blue light; negative if focus lies beyond infinity."""
        return float(self.focus_in(self.wavelength_nm))

    @property
    def meridian_vergences(self) -> tuple[float, float]:
        """Vergences in dioptres in focus in the two principal meridians, the lower first; equal without astigmatism.

        They include the Zernike terms of second order: a prescribed eye's mean is `focus_vergence`.

        >>> [round(vergence, 2) for vergence in Eye(0.004, 1.0, aberrations=((2, 2, 0.289),)).meridian_vergences]
        [0.65, 1.35]
        """
        terms = {(n, m): um for n, m, um in added_terms(*self.aberrations)}
        dioptres = 1 / defocus_term(1.0, self.pupil_diameter)  # per micrometre of c(2, 0)
        middle = self.focus_vergence + dioptres * terms.get((2, 0), 0.0)
        half = dioptres * math.hypot(terms.get((2, -2), 0.0), terms.get((2, 2), 0.0)) / math.sqrt(2)
        return middle - half, middle + half

    def focus_in(self, wavelength_nm: ArrayLike) -> FloatArray:
        """Return the vergence in dioptres of the plane in focus in light of each wavelength (nm, any shape).

        >>> Eye(0.004, 1.0).focus_in([450, 580, 650]).round(3).tolist()
        [1.954, 1.0, 0.722]
        """
        return np.asarray(self.accommodation - self.chromatic_scale * chromatic_difference(wavelength_nm))

    def refocused(self, vergence: float) -> Eye:
        """Return the same eye with its plane of focus, in its own light, at another `vergence` (D, any sign).

        >>> Eye(0.004, 1.0, wavelength_nm=450.0).refocused(2.0).focus_vergence
        2.0
        """
        return replace(self, accommodation=self.accommodation + (vergence - self.focus_vergence))

    def mirrored(self) -> Eye:
        """Return the mirror image of this eye: a left eye for a right one, whose aberrations and pupil face the nose.

        >>> Eye(0.004, 1.0, aberrations=((3, 1, 0.1), (3, -1, 0.2), (2, -2, 0.3))).mirrored().aberrations
        ((3, 1, -0.1), (3, -1, 0.2), (2, -2, -0.3))
        """
        # x changes its sign: cos(m t) by (-1)^m, and sin(|m| t), where m < 0, by the opposite.
        terms = tuple((n, m, um if (m >= 0) == (m % 2 == 0) else -um) for n, m, um in self.aberrations)
        return replace(self, aberrations=terms, pupil_offset=(-self.pupil_offset[0], self.pupil_offset[1]))

    def aberrated(self, terms: Aberrations) -> Eye:
        """Return the same eye with further Zernike `terms` (n, m, micrometres over its pupil).

        >>> Eye(0.004, 1.0, aberrations=((2, 2, 0.1),)).aberrated([(2, 2, 0.2)]).aberrations
        ((2, 2, 0.30000000000000004),)
        """
        return replace(self, aberrations=added_terms(*self.aberrations, *terms))

    def in_light(self, wavelength_nm: float) -> Eye:
        """Return the same eye at the same moment in light of another wavelength (nm)."""
        return replace(self, wavelength_nm=wavelength_nm)

    def at(self, time: float, course: TimeCourse) -> Eye:
        """Return the eye at the moment `time` (s) of the time `course` of its accommodation.

        >>> from focalgradient.eye import Oscillation
        >>> eye = Eye(0.004, 1.0).at(0.125, Oscillation(amplitude=0.25, frequency=2.0))
        >>> eye.accommodation  # a quarter of a period after the middle
        1.25
        """
        return replace(self, accommodation=self.accommodation + float(course.at(time)))

    def through(self, times: Iterable[float], course: TimeCourse) -> list[Eye]:
        """Return the eye at each of the moments `times` (s, in order) of the time `course` of its accommodation."""
        moments = ordered_times(list(times))
        return [replace(self, accommodation=float(self.accommodation + change)) for change in course.at(moments)]

    @property
    def chromatic_shift(self) -> tuple[float, float]:
        """Transverse chromatic shift x and y in radians of the image, relative to light of 580 nm.

        The wavefront of defocus V p^2 / 2 about the visual axis has the slope V p at the pupil's middle (Thibos,
        Bradley, Still, Zhang & Howarth 1990, Vision Res. 30, 33).

        >>> eye = Eye(0.004, 1.0, pupil_offset=(0.0004, 0.0))
        >>> blue, red = (eye.in_light(nm).chromatic_shift[0] for nm in (497, 605))
        >>> round(60 * float(np.degrees(blue - red)), 2)  # minutes of arc
        0.85
        """
        change = -self.chromatic_scale * float(chromatic_difference(self.wavelength_nm))
        return change * self.pupil_offset[0], change * self.pupil_offset[1]

    @property
    def wavefront(self) -> Aberrations:
        """Aberrations including the tilt of the chromatic shift in the eye's own light."""
        um = [1e6 * angle * self.pupil_diameter / 4 for angle in self.chromatic_shift]  # a tilt c has the slope 2 c / a
        tilts = [(1, m, c) for m, c in zip((1, -1), um, strict=True) if c]
        return (*self.aberrations, *tilts) if tilts else self.aberrations

    def defocus(self, distance: ArrayLike) -> FloatArray:
        """Return the defocus in dioptres of points at `distance` (m, any shape): positive beyond the plane of focus.

        >>> Eye(0.004, 2.0).defocus([0.25, 0.5, np.inf]).tolist()
        [-2.0, 0.0, 2.0]
        """
        return defocus_at(distance, self.focus_vergence)

    def blur_radius(self, distance: ArrayLike) -> FloatArray:
        """Return the angular radius in radians of the blur disc of points at `distance` (m, any shape).

        Of an astigmatic eye, the disc of its spherical equivalent; `meridian_vergences` give the blur's two half-axes.

        >>> round(float(Eye(0.004, 2.0).blur_radius(1.0)), 9)  # 2 mm x 1 D
        0.002
        """
        return np.abs(self.defocus(distance)) * (self.pupil_diameter / 2)

    @property
    def by_rays(self) -> bool:
        """True: views of an eye in one wavelength are rendered by rays, whose blur is a disc (`optics.own_blur`)."""
        return True

    @property
    def isotropic(self) -> bool:
        """Whether blur is rotationally symmetric: of a clear pupil, or with aberrations of m = 0 only."""
        return not any(self.pupil_offset) and all(m == 0 for _, m, _ in self.aberrations)

    @property
    def clear(self) -> bool:
        """Whether the pupil is clear: centred, without aberrations, zones and the Stiles-Crawford effect."""
        return not (self.aberrations or self.stiles_crawford or self.lens or any(self.pupil_offset))

    def optical_transfer(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergence: float
    ) -> FloatArray | NDArray[np.complex128]:
        """Return the OTF for points at `vergence` (D), at frequencies in cycles per radian; broadcasts.

        >>> round(float(Eye(0.004, 1.0).optical_transfer(0.0, 5 * 180 / np.pi, 0.5)), 3)
        0.637
        """
        check_number("vergence", vergence, "dioptres")
        down = check_finite("frequency_y", frequency_y, "cycles per radian")
        right = check_finite("frequency_x", frequency_x, "cycles per radian")
        return self.pupil(vergence).transfer(down, right)

    def through_focus(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike
    ) -> FloatArray | NDArray[np.complex128]:
        """Return the OTF for points at each of `vergences` (D): L x the frequencies' shape.

        Right to 1e-3; of a clear pupil from a table, right to about 1e-4.

        >>> Eye(0.004, 1.0).through_focus(0.0, np.degrees(5), [0.5, 1.0]).round(2).tolist()
        [0.64, 0.95]
        """
        down, right = np.broadcast_arrays(np.asarray(frequency_y, float), np.asarray(frequency_x, float))
        defocus = self.focus_vergence - np.atleast_1d(np.asarray(vergences, float))
        if not self.clear:
            return through_focus(down, right, self.pupil(self.focus_vergence), defocus)
        levels = np.abs(defocus).reshape(-1, *(1,) * down.ndim)
        return wave_transfer(np.hypot(down, right), levels, self.pupil_diameter, self.wavelength_nm)

    def pupil(self, vergence: float) -> Pupil:
        """Return the pupil function of light from a point at `vergence` (D)."""
        defocus = self.focus_vergence - vergence
        return Pupil(self.pupil_diameter, self.wavelength_nm, defocus, self.wavefront, self.stiles_crawford, self.lens)

    def distance_from_blur(self, radius: ArrayLike, side: Side) -> FloatArray:
        """Return the distance in metres at which the blur disc has this angular `radius` (rad), on one `side` of focus.

        ``inf`` where infinity just blurs so much, ``nan`` where no point in front of the eye does.

        >>> [float(Eye(0.004, 2.0).distance_from_blur(0.002, side)) for side in ("beyond", "nearer")]
        [1.0, 0.3333333333333333]
        """
        return distance_of_blur(radius, side, self.pupil_diameter, self.focus_vergence)


def _refuse_unprescribed(pupil_diameter: float | None, person: PersonalOptics) -> None:
    """Raise `InputError` for an eye with neither a refraction nor an age that lacks something or has too much."""
    for name, value in person._asdict().items():
        if value is not None:
            raise InputError(
                f"{name} is given without a refraction or an age, from which the eye's optics would follow: give one "
                'of them (refraction="plano" for an eye without refractive error).'
            )
    name = "pupil_diameter" if pupil_diameter is None else "accommodation"
    raise InputError(
        f"{name} is missing: give pupil_diameter (m) and accommodation (D), as Eye(0.004, 1.0), or a person's "
        'refraction or age, as Eye(refraction="-2.00 -0.75 x 180", age=30).'
    )
