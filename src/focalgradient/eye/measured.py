"""Measured wavefronts: Zernike coefficients in OSA order, resized to any pupil within the measured one.

Thibos, Applegate, Schwiegerling & Webb (2002), "Standards for reporting the optical aberrations of eyes", J. Refract.
Surg. 18, S652 (ANSI Z80.28): term j has n = ceil((-3 + sqrt(9 + 8 j)) / 2) and m = 2 j - n (n + 2).
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, check_finite
from focalgradient.eye.chromatic import REFERENCE_NM
from focalgradient.eye.ranges import Pupil, Wavelength
from focalgradient.eye.wavefront import Aberrations, added_terms, check_aberrations, is_term, radial_over_power
from focalgradient.files import LARGEST_LIST, printable, read_bytes
from focalgradient.files.cells import as_number
from focalgradient.files.containers import refuse_other_container
from focalgradient.files.matlab import read_matlab
from focalgradient.files.tables import parse_table, read_cells
from focalgradient.quantities import Range, Whole

__all__ = ["ZernikePopulation", "osa_index", "osa_order", "read_zernike", "resized_zernike"]

MOST = 231
"""Maximum number of coefficients: up to radial order 20."""

MEASURED_SHARE = Range(
    "diameters", most=1, positive=True, remedy="outside of the measured pupil the wavefront is unknown"
)
"""Diameter of a pupil over that of the measured one."""

LARGEST_UM = {True: 100.0, False: 20.0}
"""Upper limits on coefficients in micrometres, of defocus and astigmatism and of higher orders: 20 D over 8 mm are 46
um, and coma of keratoconic eyes stays below 10 um. Choices that reject tables in nanometres."""

NAMED = re.compile(
    r"\s*[ZC]\s*[\[(_{]?\s*(\d+)(?:\s*[,;^_]\s*([+-]?\d+)|\s+([+-]?\d+)(?!\d|,\d))?\s*[\])}]?\s*(?:[:=,;\s]\s*)"
    r"([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?)\s*(?:[uµμ]m|microns?)?\s*$",
    re.IGNORECASE,
)
"""Pattern of a line of an aberrometer's table: name of the term (n and m, or OSA index) and coefficient."""

TERM = re.compile(r"\s*[ZC]\s*[\[(_{]?\s*\d", re.IGNORECASE)
"""Pattern of the beginning of a line that names a term."""

OTHER_TABLES = {
    "noll": "in Noll's order",
    "malacara": "in Malacara's order",
    **dict.fromkeys(("fringe", "wyant", "arizona", "loomis"), "in the order of the fringe (Wyant) polynomials"),
    **dict.fromkeys(
        ("born", "wolf", "mahajan", "zemax", "opticstudio", "codev", "iso"), "in another order or normalisation"
    ),
    **dict.fromkeys(("unnormalised", "unnormalized", "peak"), "not normalised"),
    **dict.fromkeys(("waves", "wave", "wavelengths", "lambda", "λ", "rad", "radians"), "in waves"),
    **dict.fromkeys(("dioptres", "diopters", "dioptre", "diopter", "dpt"), "in dioptres"),
    **dict.fromkeys(("inch", "inches", "angstrom", "angstroms", "percent"), "in another unit"),
}
"""Words in a heading or comment which show that a table is neither in OSA order nor a length."""

IN_BRACKETS = frozenset(
    ("osa", "ansi", "z", "standard", "normalised", "normalized", "od", "os", "left", "right", "eye")
)
"""Words that brackets of a heading may hold beside units of length."""

LENGTHS_UM = {
    **dict.fromkeys(("um", "µm", "micron", "microns", "micrometre", "micrometres", "micrometer", "micrometers"), 1.0),
    **dict.fromkeys(("nm", "nanometre", "nanometres", "nanometer", "nanometers"), 1e-3),
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 1e3),
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1e6),
    **dict.fromkeys(("pm", "picometres", "picometers"), 1e-6),
    **dict.fromkeys(("cm", "centimetres", "centimeters"), 1e4),
}
"""Units of length that headings state, in micrometres."""


def osa_order(index: int) -> tuple[int, int]:
    """Return radial order n and meridional frequency m of the OSA's single index, 0 (piston) and up.

    >>> [osa_order(j) for j in (0, 1, 2, 3, 4, 5, 12)]
    [(0, 0), (1, -1), (1, 1), (2, -2), (2, 0), (2, 2), (4, 0)]
    """
    Whole(0, MOST - 1).check("the index of a Zernike term", index)
    n = (math.isqrt(8 * index + 1) - 1) // 2
    return n, 2 * index - n * (n + 2)


def osa_index(n: int, m: int) -> int:
    """Return the OSA's single index of a Zernike term.

    >>> osa_index(4, 0)
    12
    """
    return (n * (n + 2) + m) // 2


def zernike_terms(coefficients_um: ArrayLike) -> Aberrations:
    """Return the non-zero terms (n, m, micrometres) of coefficients in OSA order."""
    values = check_finite("coefficients_um", coefficients_um, "micrometres, in the order of the OSA from piston on")
    if values.ndim != 1 or not 1 <= values.size <= MOST:
        raise InputError(
            f"coefficients_um must be 1 to {MOST} numbers in micrometres, in the order of the OSA from piston on."
        )
    return tuple((*osa_order(j), float(value)) for j, value in enumerate(values) if value)


def resized_zernike(aberrations: Aberrations, share: float) -> Aberrations:
    """Return the coefficients of the same wavefront over a concentric pupil smaller by `share`.

    Janssen & Dirksen (2006), "Concise formula for the Zernike coefficients of scaled pupils", JM3 5, 030501.

    Parameters
    ----------
    aberrations
        Terms (n, m, micrometres) over the whole pupil.
    share
        Diameter of the new pupil over that of the old one, above 0 and at most 1: the wavefront outside is unknown.

    Raises
    ------
    InputError
        If a term does not exist, or the new pupil is larger.

    Examples
    --------
    Spherical aberration over half the pupil falls to a sixteenth, and leaves defocus.

    >>> [(n, m, round(c, 4)) for n, m, c in resized_zernike(((4, 0, 0.16),), 0.5)]
    [(0, 0, 0.1342), (2, 0, -0.1162), (4, 0, 0.01)]
    """
    check_aberrations(aberrations)
    MEASURED_SHARE.check("share", share)
    terms = []
    for n, m, coefficient in aberrations:
        for order in range(abs(m), n + 1, 2):
            kept = share**order * radial_over_power(n, order, share**2)
            if order + 2 <= n:
                kept -= share ** (order + 2) * radial_over_power(n, order + 2, share**2)
            terms.append((order, m, coefficient * math.sqrt((n + 1) / (order + 1)) * kept))
    return added_terms(*terms)


def read_zernike(path: str | os.PathLike[str]) -> tuple[float, ...]:
    r"""Read a table of Zernike coefficients.

    Lines of one number (the coefficients in the OSA's order, from piston on), of two (OSA index, coefficient) or of
    three (n, m, coefficient); separated by commas, semicolons, tabs or spaces. Terms may be named as aberrometers name
    them, such as Z(2,-2), Z[4,0], C2,0 or Z12 (OSA index), and then lines that name no term are left out. Otherwise a
    heading, empty lines and lines that begin with # are. Coefficients are in micrometres, of normalised polynomials. Of
    a MATLAB file (.mat), as ISETBio saves it, the vector ``zcoeffs`` is read, of a struct or by itself.

    Returns
    -------
    tuple of float
        Coefficients in micrometres in the OSA's order, from piston on; 0 where the table has none.

    Raises
    ------
    InputError
        If the file cannot be read, or a line is none of these.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "eye.csv").write_text("n,m,um\n2,0,0.3\n4,0,0.05\n")
    ...     coefficients = read_zernike(Path(folder, "eye.csv"))
    >>> coefficients[4], coefficients[12]
    (0.3, 0.05)
    """
    if str(path).lower().endswith(".mat"):
        return _of_matlab(path)
    data = read_bytes(path, "a table of Zernike coefficients", LARGEST_LIST)
    refuse_other_container(data, printable(path), "a table of Zernike coefficients")
    rows, factor = _named_terms(data, printable(path)) or _rows(data, printable(path))
    found: dict[int, float] = {}
    for place, row in enumerate(rows):
        index = place if len(row) == 1 else _index(path, row[:-1])
        if index in found:
            raise InputError(
                f"{printable(path)}: the coefficient of OSA index {index} is there twice: give one number."
            )
        found[index] = value = row[-1] * factor
        if abs(value) > (most := LARGEST_UM[index < 6]) and index > 2:
            raise InputError(
                f"{printable(path)}: the coefficient of OSA index {index} is {value:g}, but no eye has more than "
                f"{most:g} micrometres: give the table in micrometres and the OSA's order."
            )
    if max(found) >= MOST:
        raise InputError(f"{printable(path)} has more than {MOST} coefficients, which radial order 20 has.")
    return tuple(found.get(index, 0.0) for index in range(max(found) + 1))


def _rows(data: bytes, name: str) -> tuple[list[list[float]], float]:
    """Return the rows of one, two or three numbers, and the factor from their unit to micrometres."""
    table = parse_table(data, name, "a table of Zernike coefficients", header=False, spaces=True).with_points()
    factor = _micrometres(name, [", ".join(table.header)], table.comments)
    rows = []
    for number, row in zip(table.places, table.rows, strict=True):
        filled = [cell for cell in row if cell.strip()]
        values = [value for cell in filled if (value := as_number(cell)) is not None]
        if len(values) < len(filled):
            raise InputError(f"{name}, line {number}: {', '.join(row)[:40]!r} is not one, two or three numbers.")
        rows.append(values)
    width = len(rows[0]) if rows else 0
    if width not in (1, 2, 3) or any(len(row) != width for row in rows):
        raise InputError(f"{name} must have on each line a coefficient, or its OSA index and it, or n, m and it.")
    return rows, factor


def _named_terms(data: bytes, name: str) -> tuple[list[list[float]], float] | None:
    """Return the rows of an aberrometer's table, whose lines name their terms, and its factor; None for others."""
    text = data.decode("utf-8-sig", "replace").replace("−", "-")
    lines = [line.strip() for line in text.splitlines()]
    named = [_named(line) for line in lines]
    if all(row is None for row in named):
        return None
    for number, (line, row) in enumerate(zip(lines, named, strict=True), start=1):
        if row is None and TERM.match(line):
            raise InputError(
                f"{name}, line {number}: {line[:40]!r} names a Zernike term, but not with one coefficient in "
                "micrometres: give Z(4,0) 0.05."
            )
    factor = _micrometres(name, [], [line for line, row in zip(lines, named, strict=True) if row is None])
    return [row for row in named if row is not None], factor


def _named(line: str) -> list[float] | None:
    """Parse a line that names its term: index and coefficient, or n, m and coefficient."""
    found = NAMED.match(line)
    return None if found is None else [float(part.replace(",", ".")) for part in found.groups() if part is not None]


def _of_matlab(path: str | os.PathLike[str]) -> tuple[float, ...]:
    """Read the vector ``zcoeffs`` of a MATLAB file."""
    content = read_matlab(path)
    structs = [value for name, value in content.items() if hasattr(value, "zcoeffs") and not name.startswith("__")]
    found = content.get("zcoeffs", structs[0].zcoeffs if structs else None)
    values = np.atleast_1d(np.asarray(found, dtype=object))
    try:
        numbers = values.astype(float)
    except (TypeError, ValueError):
        numbers = np.array([np.nan])
    if numbers.ndim != 1 or not np.isfinite(numbers).all() or numbers.size > MOST:
        raise InputError(f"{printable(path)} has no vector zcoeffs of one eye, in micrometres: save one.")
    return tuple(float(value) for value in numbers)


def _micrometres(name: str, headings: Sequence[str], comments: Sequence[str]) -> float:
    """Return the factor from the stated unit to micrometres; refuse other orders and units.

    Comments state a unit in brackets or behind "in" or "unit": they also hold the pupil's size and the wavelength.

    >>> _micrometres("x.csv", ["index, coefficient (nm)"], []), _micrometres("x.csv", ["n, m, um"], [])
    (0.001, 1.0)
    """
    factors = set()
    for line in (*headings, *comments):
        text = line.lower().replace("μ", "µ").replace("_", " ").replace("%", " percent ")
        stated = [
            word for within in re.findall(r"[(\[]([^)\]]*)[)\]]", text) for word in re.findall("[a-zµλ]+", within)
        ]
        foreign = [word for word in stated if word not in LENGTHS_UM and word not in IN_BRACKETS]
        if foreign and line in headings:
            raise InputError(
                f"{name} says {line[:60]!r}, but coefficients must be in micrometres and in the OSA's order (ANSI "
                "Z80.28): convert them, or leave the brackets out."
            )
        units = text if line in headings else " ".join(re.findall(r"(?:[(\[]|\bin |\bunits?\W+)\s*([a-zµ]+)", text))
        for word in re.findall(r"[a-zµλ&]+", text):
            what = OTHER_TABLES.get(word)
            if what:
                raise InputError(
                    f"{name} says {line[:60]!r} and so is {what}, but coefficients must be in micrometres and in the "
                    "OSA's order (ANSI Z80.28): convert them."
                )
            if (
                word in LENGTHS_UM
                and re.search(rf"\b{word}\b", units)
                and not (word == "m" and not re.search(r"[(\[]\s*m\s*[)\]]", text))
            ):
                factors.add(LENGTHS_UM[word])
    if len(factors) > 1:
        raise InputError(f"{name} states several units of length: state the one of the coefficients.")
    return factors.pop() if factors else 1.0


def _index(path: str | os.PathLike[str], orders: Sequence[float]) -> int:
    """Return the OSA index of a row, from its index or from n and m."""
    if all(abs(value) < MOST and value == int(value) for value in orders):
        whole = [int(value) for value in orders]
        if len(whole) == 1 and whole[0] >= 0:
            return whole[0]
        if len(whole) == 2 and is_term(*whole):
            return osa_index(*whole)
    raise InputError(f"{printable(path)}: there is no Zernike term {', '.join(f'{value:g}' for value in orders)}.")


@dataclass(frozen=True)
class ZernikePopulation:
    """Normal distribution of the Zernike coefficients of many eyes.

    Parameters
    ----------
    mean_um
        Mean coefficients in micrometres, in the OSA's order from piston on.
    covariance_um2
        Covariance of the coefficients, N x N.
    measured_diameter
        Diameter of the measured pupil in metres.
    measured_nm
        Wavelength of the measurement in nm.

    Raises
    ------
    InputError
        If the covariance is none, or a number is out of range.

    Examples
    --------
    >>> eyes = ZernikePopulation([0, 0, 0, 0, 0.1, 0, 0], np.diag([0, 0, 0, 0.04, 0.09, 0.04, 0.01]), 0.006)
    >>> eyes.drawn(np.random.default_rng(1)).round(2).tolist()[:4]
    [0.0, 0.0, 0.0, 0.09]
    """

    mean_um: ArrayLike
    covariance_um2: ArrayLike
    measured_diameter: Pupil
    measured_nm: Wavelength = REFERENCE_NM

    def __post_init__(self) -> None:
        check_fields(self)
        zernike_terms(self.mean_um)
        self._root()

    @classmethod
    def read(
        cls,
        mean: str | os.PathLike[str],
        covariance: str | os.PathLike[str],
        measured_diameter: float,
        measured_nm: float = REFERENCE_NM,
    ) -> ZernikePopulation:
        """Read the mean as `read_zernike` does, and the covariance from a table without a header."""
        cells = read_cells(covariance, "a table of covariances", largest=LARGEST_LIST, header=False, spaces=True)
        rows = [[as_number(cell) for cell in row if cell.strip()] for row in cells.with_points().rows]
        if cells.header or not rows or any(len(row) != len(rows) or None in row for row in rows):
            raise InputError(f"{printable(covariance)} is not a square matrix of numbers.")
        table = np.array(rows, dtype=float)
        return cls(read_zernike(mean), table, measured_diameter, measured_nm)

    def _root(self) -> FloatArray:
        """Return a square root of the covariance; eigenvalues made slightly negative by rounding become 0."""
        table, count = np.asarray(self.covariance_um2, dtype=float), np.size(self.mean_um)
        if table.shape != (count, count) or not np.isfinite(table).all() or not np.allclose(table, table.T, atol=1e-6):
            raise InputError(
                f"covariance_um2 must be symmetric, of {count} rows and columns, as the mean has {count} coefficients."
            )
        values, vectors = np.linalg.eigh((table + table.T) / 2)
        if values[0] < -1e-3 * max(values[-1], 1e-12):
            raise InputError("covariance_um2 is not a covariance: a sum of coefficients has negative variance.")
        return vectors * np.sqrt(np.clip(values, 0, None))

    def drawn(self, random: np.random.Generator) -> FloatArray:
        """Draw the coefficients of one eye, in micrometres."""
        found: FloatArray = np.asarray(self.mean_um, dtype=float) + self._root() @ random.standard_normal(
            np.size(self.mean_um)
        )
        return found
