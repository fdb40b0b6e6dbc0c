"""An eye given by its pupil or by a file, for ``focalgradient blur`` and ``focalgradient eye``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from focalgradient.cli.person import person_eye
from focalgradient.errors import InputError
from focalgradient.files import printable, read_toml
from focalgradient.plausibility import given_as

if TYPE_CHECKING:
    from focalgradient.eye import Eye, SpectralBasis

__all__ = ["eye_of", "eye_of_file", "spectra_of"]


def eye_of(options: dict[str, Any], accommodation: float) -> Eye:
    """Return the eye of ``--eye``, or of ``--pupil`` and a person's options, accommodated to `accommodation` (D)."""
    if options["eye_file"] is None:
        return person_eye(options, options["pupil"], accommodation)
    return eye_of_file(options["eye_file"], accommodation)


def spectra_of(options: dict[str, Any]) -> SpectralBasis | None:
    """Return the spectra of a picture's colours under ``--illuminant``, filtered by a lens of ``--age``.

    None: those of the display that the toolkit assumes.
    """
    if options["illuminant"] is None and options["age"] is None:
        return None
    from focalgradient.eye import SpectralBasis

    name = options["illuminant"]
    basis = SpectralBasis.of_display() if name is None else SpectralBasis.of_srgb(name)
    return basis if options["age"] is None else basis.through_lens(options["age"])


def eye_of_file(path: Path, accommodation: float) -> Eye:
    """Return the eye described by a TOML file, accommodated to `accommodation` (D)."""
    with given_as({"pupil_diameter": ("pupil_mm", "mm")}):
        return _of_file(path, accommodation)


def _of_file(path: Path, accommodation: float) -> Eye:
    """Return the eye of the file."""
    from focalgradient.eye import Eye

    table = read_toml(path, "an eye's file")
    known = {"pupil_mm", "chromatic_scale", "stiles_crawford", "aberrations", "wavelength_nm"}
    known |= {"zernike", "measured_mm", "measured_nm"}
    if unknown := sorted(set(table) - known):
        raise InputError(
            f"{printable(path)} has the key {unknown[0]!r}, but an eye may have only {', '.join(sorted(known))}: "
            "remove it."
        )
    if not isinstance(table.get("pupil_mm"), (int, float)):
        raise InputError(f"{printable(path)}: pupil_mm is missing: give the pupil's diameter in millimetres.")
    if ("zernike" in table) + ("aberrations" in table) > 1:
        raise InputError(f"{printable(path)} has both zernike and aberrations: leave one out.")
    if "zernike" not in table and (stray := {"measured_mm", "measured_nm"} & set(table)):
        raise InputError(f"{printable(path)} has {min(stray)} without zernike, the table that it belongs to: add it.")
    try:
        if "zernike" in table:
            return _measured_eye(path, table, accommodation)
        others = {name: value for name, value in table.items() if name not in ("pupil_mm", "aberrations")}
        terms = tuple((n, m, float(um)) for n, m, um in table.get("aberrations", []))
        return Eye(1e-3 * table["pupil_mm"], accommodation, aberrations=terms, **others)
    except InputError as error:
        raise InputError(f"{printable(path)}: {error}") from error
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{printable(path)}: aberrations must be a list of [n, m, micrometres], and all other keys numbers."
        ) from error


def _measured_eye(path: Path, table: dict[str, Any], accommodation: float) -> Eye:
    """Return the eye of a table of Zernike coefficients, with its defocus corrected to the given accommodation."""
    from dataclasses import replace

    from focalgradient.eye import Eye, read_zernike

    if not isinstance(table["zernike"], str):
        raise InputError(f"{printable(path)}: zernike must be the name of a table of coefficients in micrometres.")
    others = {name: value for name, value in table.items() if name not in ("pupil_mm", "measured_mm", "zernike")}
    measured = {"measured_diameter": 1e-3 * table["measured_mm"]} if "measured_mm" in table else {}
    coefficients = read_zernike(path.parent / table["zernike"])
    eye = Eye.from_zernike(coefficients, 1e-3 * table["pupil_mm"], **measured, **others)
    return replace(eye, accommodation=accommodation)
