"""An eye given by its pupil or by a file, for ``focalgradient blur`` and ``focalgradient eye``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from focalgradient.cli.person import person_eye

if TYPE_CHECKING:
    from focalgradient.eye import Eye, SpectralBasis

__all__ = ["eye_of", "spectra_of"]


def eye_of(options: dict[str, Any], accommodation: float) -> Eye:
    """Return the eye of ``--eye``, or of ``--pupil`` and a person's options, accommodated to `accommodation` (D)."""
    if options["eye_file"] is None:
        return person_eye(options, options["pupil"], accommodation)
    from focalgradient.eye import read_eye

    return read_eye(options["eye_file"], accommodation)


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
