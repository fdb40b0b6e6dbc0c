"""Eyes described by data of a person, or by a file."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from focalgradient.errors import InputError, check_fields
from focalgradient.eye.measured import read_zernike
from focalgradient.eye.model_eye import Eye
from focalgradient.eye.peripheral_refraction import EMMETROPES, MYOPES, PeripheralRefraction
from focalgradient.eye.ranges import OLDEST, warn_if_artificial
from focalgradient.eye.refraction import Refraction, worn_of
from focalgradient.eye.typical import typical_aberrations
from focalgradient.eye.zones import ZonedLens
from focalgradient.files import printable, read_toml
from focalgradient.plausibility import given_as
from focalgradient.quantities import LUMINANCE, Quantity

__all__ = ["EyeDescription", "read_eye"]

MYOPIA = -0.5
"""Mean sphere in dioptres from which an eye is myopic (International Myopia Institute: Flitcroft et al. 2019, Invest.
Ophthalmol. Vis. Sci. 60, M20)."""

KEYS = {
    *("pupil_mm", "chromatic_scale", "stiles_crawford", "aberrations", "wavelength_nm"),
    *("zernike", "measured_mm", "measured_nm"),
}
"""Keys of an eye's file."""


YEARS = Quantity("years", "years", least=1, most=OLDEST)
"""Age of a person, in years."""


@dataclass(frozen=True, slots=True)
class EyeDescription:
    """Data of a person's eye; None: unknown.

    Parameters
    ----------
    refraction
        Prescription of the eye, such as "-2.00 -0.75 x 180" (sphere, cylinder, axis).
    correction
        Correction worn by the eye of the refraction; both lenses correct it fully.  [default: none]
    age
        Age: sets the amplitude of accommodation, the density of the lens and, unless it is given, the pupil.
    luminance
        Instead of the pupil: luminance (cd/m^2) of a field of 20 degrees, which with the age sets the pupil.
        [default with a refraction or an age: 100]
    aberrations
        Coma, trefoil and spherical aberration, each with its mean magnitude in healthy eyes.  [default: none]
    zones
        Multifocal lens: outer diameter (mm) and added power (D) of each zone, centre outwards, as 2:2,8:0.

    Raises
    ------
    InputError
        If the zones cannot be read.
    """

    refraction: Annotated[str | None, "RX"] = None
    correction: Literal["none", "spectacles", "contact-lens"] | None = None
    age: Annotated[float | None, YEARS] = None
    luminance: Annotated[float | None, LUMINANCE, "CD"] = None
    aberrations: Literal["typical"] | None = None
    zones: Annotated[str | None, "MM:D,..."] = None

    def __post_init__(self) -> None:
        check_fields(self)
        if self.zones is not None:
            ZonedLens.parse(self.zones)

    @property
    def is_empty(self) -> bool:
        """Whether nothing is known."""
        return all(getattr(self, field.name) is None for field in fields(self))

    @property
    def has_natural_pupil(self) -> bool:
        """Whether the description determines the diameter of the pupil."""
        return any(one is not None for one in (self.refraction, self.age, self.luminance))

    @property
    def periphery(self) -> PeripheralRefraction:
        """Mean peripheral refraction of the group that the eye belongs to: of myopes from -0.5 D, or of emmetropes.

        >>> EyeDescription(refraction="-3.00").periphery is MYOPES, EyeDescription(age=30).periphery is MYOPES
        (True, False)
        """
        if self.refraction is None or Refraction.parse(self.refraction).power_vector[0] > MYOPIA:
            return EMMETROPES
        return MYOPES

    def response(self, looking_at: float) -> float:
        """Return the dioptres by which the eye accommodates to look at a vergence (D), as far as it can.

        >>> round(EyeDescription(refraction="-2.00", age=30).response(2.5), 2)
        0.55
        """
        refraction = Refraction() if self.refraction is None else Refraction.parse(self.refraction)
        return worn_of(self.correction).response(refraction, looking_at, self.age)

    def eye(self, looking_at: float, pupil_diameter: float | None = None) -> Eye:
        """Return the eye that looks at a vergence (D), with a pupil in metres (None: its natural one).

        Raises
        ------
        InputError
            If a number is out of its range, or two parameters contradict each other.

        Examples
        --------
        >>> eye = EyeDescription(refraction="-2.00", age=60, correction="spectacles").eye(looking_at=2.5)
        >>> round(eye.focus_vergence, 2), round(1e3 * eye.pupil_diameter, 2)
        (0.11, 3.33)
        """
        if self.correction is not None and self.refraction is None:
            raise InputError("correction corrects the eye of refraction: give refraction as well.")
        if self.is_empty:
            eye = Eye(pupil_diameter, looking_at)
        else:
            eye = Eye(
                pupil_diameter,
                lens=None if self.zones is None else ZonedLens.parse(self.zones),
                refraction="plano" if self.refraction is None else self.refraction,
                age=self.age,
                looking_at=looking_at,
                correction=self.correction,
                luminance=self.luminance,
            )
        if pupil_diameter is not None:
            warn_if_artificial(pupil_diameter)
        if self.aberrations is None:
            return eye
        return replace(eye, aberrations=(*eye.aberrations, *typical_aberrations(eye.pupil_diameter)))


def read_eye(path: str | Path, accommodation: float) -> Eye:
    r"""Return the eye described by a TOML file, accommodated to `accommodation` (D).

    The file has ``pupil_mm`` and, as wanted, ``chromatic_scale``, ``stiles_crawford``, ``wavelength_nm``, and either
    ``aberrations``, a list of [n, m, micrometres], or ``zernike``, the name of a table for `read_zernike`, whose
    defocus is corrected, with ``measured_mm`` and ``measured_nm``, the pupil and the wavelength of the measurement.

    Raises
    ------
    InputError
        If the file cannot be read, or a key is unknown, missing or out of its range.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "eye.toml")
    ...     _ = path.write_text("pupil_mm = 4.0\naberrations = [[3, 1, 0.1]]\n")
    ...     eye = read_eye(path, 1.0)
    >>> eye.pupil_diameter, eye.accommodation, eye.aberrations
    (0.004, 1.0, ((3, 1, 0.1),))
    """
    path = Path(path)
    table = read_toml(path, "an eye's file")
    name = printable(path)
    if unknown := sorted(set(table) - KEYS):
        raise InputError(
            f"{name} has the key {unknown[0]!r}, but an eye may have only {', '.join(sorted(KEYS))}: remove it."
        )
    if not isinstance(table.get("pupil_mm"), (int, float)):
        raise InputError(f"{name}: pupil_mm is missing: give the pupil's diameter in millimetres.")
    if "zernike" in table and "aberrations" in table:
        raise InputError(f"{name} has both zernike and aberrations: leave one out.")
    if "zernike" not in table and (stray := {"measured_mm", "measured_nm"} & set(table)):
        raise InputError(f"{name} has {min(stray)} without zernike, the table that it belongs to: add it.")
    try:
        with given_as({"pupil_diameter": ("pupil_mm", "mm")}):
            return _of_table(table, path.parent, accommodation)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{name}: aberrations must be a list of [n, m, micrometres], and all other keys numbers."
        ) from error


def _of_table(table: dict[str, Any], folder: Path, accommodation: float) -> Eye:
    """Return the eye of a file's keys."""
    named = ("pupil_mm", "aberrations", "zernike", "measured_mm")
    pupil, others = 1e-3 * table["pupil_mm"], {key: value for key, value in table.items() if key not in named}
    if "zernike" not in table:
        terms = tuple((n, m, float(um)) for n, m, um in table.get("aberrations", []))
        return Eye(pupil, accommodation, aberrations=terms, **others)
    if not isinstance(table["zernike"], str):
        raise InputError("zernike must be the name of a table of coefficients in micrometres.")
    measured = 1e-3 * table["measured_mm"] if "measured_mm" in table else None
    eye = Eye.from_zernike(read_zernike(folder / table["zernike"]), pupil, measured_diameter=measured, **others)
    return replace(eye, accommodation=accommodation)
