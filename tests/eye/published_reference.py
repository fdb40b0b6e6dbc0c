"""Make published_reference.json: what other libraries and other published equations say of the parts of an eye.

    pip install luxpy==1.12.5 visisipy==0.5.0 && python tests/eye/published_reference.py

Nothing here is computed by this package's own equations: pupils by luxpy; the density of the lens by the CIE's
170-1:2006 (Pokorny, Smith & Lutze 1987), also by luxpy; chromatic difference by Atchison & Smith's equation; glare by
the CIE's total equation; cones by a study with adaptive optics; and foci off axis by visisipy, which traces
rays. The libraries are not dependencies: the tests read the numbers.
"""

from __future__ import annotations

import json
import sys
import warnings
from pathlib import Path

import numpy as np

LUMINANCES = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)  # cd/m^2
AGES = (20, 32, 45, 60, 80)
FIELDS = (4.0, 20.0, 60.0)  # degrees
NANOMETRES = (400, 410, 420, 430, 440, 450, 460, 480, 500, 550, 600, 650, 700)
GLARE_DEGREES = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 90.0)

CONES_MM = (0.18, 0.27, 0.36, 0.45, 0.54, 0.72, 0.90, 1.08, 1.35, 1.62, 1.89, 2.16)
CONES = {  # thousand cones in a square millimetre, of 10 people of 22 to 35 years; by the side of the retina
    "superior": (63.5, 52.7, 42.4, 34.0, 29.6, 22.1, 18.5, 15.7, 13.1, 11.7, 10.0, 8.7),
    "inferior": (62.8, 55.3, 44.6, 36.3, 31.4, 23.9, 19.4, 16.6, 12.8, 11.5, 10.2, 8.1),
    "nasal": (68.2, 59.7, 50.0, 43.7, 37.8, 29.1, 24.2, 19.1, 16.8, 14.5, 11.9, 10.4),
    "temporal": (75.2, 59.2, 50.5, 41.2, 37.3, 28.1, 24.1, 19.9, 16.3, 13.2, 11.5, 9.7),
}
"""Song, Chui, Zhong, Elsner & Burns (2011), Invest. Ophthalmol. Vis. Sci. 52, 7376, Table 1."""


def pupils() -> list[dict[str, float]]:
    """Diameters in mm by luxpy, which follows the second form of Watson & Yellott (2012)."""
    from luxpy import get_pupil_diameter_watson2012

    return [
        {
            "luminance": light,
            "age": age,
            "field_deg": field,
            "eyes": eyes,
            "mm": round(get_pupil_diameter_watson2012(light, age=age, adapDiam=field, nEyes=eyes).item(), 5),
        }
        for light in LUMINANCES
        for age in AGES
        for field in FIELDS
        for eyes in (1, 2)
    ]


def lenses() -> list[dict[str, float]]:
    """Density (log10) of the media of CIE 170-1:2006 less that at 32 years, by luxpy."""
    from luxpy.toolboxes.indvcmf import cie2006cmfsEx

    passed = {age: cie2006cmfsEx(age=age, out="LMS,trans_lens")[1] for age in AGES}
    return [
        {"age": age, "nm": nm, "density": round(float(-np.log10(np.interp(nm, one[0, 0], one[1, 0]))), 4)}
        for age, one in passed.items()
        for nm in NANOMETRES
    ]


def chromatic() -> list[dict[str, float]]:
    """Difference of refraction from 580 nm (D).

    Equation 5 of Atchison & Smith (2005, "Chromatic dispersions of the ocular media of human eyes", J. Opt. Soc. Am. A
    22, 29): Cauchy's form, fitted to the dispersions of the media and to measured eyes.
    """

    def refraction(nm: float) -> float:
        return 1.60911 - 6.70941e5 / nm**2 + 5.55334e10 / nm**4 - 5.59998e15 / nm**6

    return [{"nm": nm, "D": round(refraction(nm) - refraction(580), 5)} for nm in NANOMETRES]


def glare() -> list[dict[str, float]]:
    """Veiling luminance for each lux (1/sr).

    By the total equation of Vos & van den Berg (1999, CIE 135/1), of which the general equation is a short form.
    """
    rows = []
    for age in (20, 50, 80):
        for pigment in (0.0, 0.5, 1.2):
            for angle in GLARE_DEGREES:
                old = (age / 70) ** 4
                core = 9.2e6 / (1 + (angle / 0.0046) ** 2) ** 1.5 + 1.5e5 / (1 + (angle / 0.045) ** 2) ** 1.5
                lens = 400 / (1 + (angle / 0.1) ** 2) + 3e-8 * angle**2
                wall = 1300 / (1 + (angle / 0.1) ** 2) ** 1.5 + 0.8 / (1 + (angle / 0.1) ** 2) ** 0.5
                total = (1 - 0.08 * old) * core + (1 + 1.6 * old) * (lens + pigment * wall) + 2.5e-3 * pigment
                rows.append({"age": age, "pigment": pigment, "degrees": angle, "veil": float(f"{total:.6g}")})
    return rows


def off_axis() -> list[dict[str, float]]:
    """Vergences in focus less those on the axis (D), of the schematic eye's surfaces: rays traced by visisipy."""
    sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
    from off_axis_of_visisipy import DEGREES, exit_over_entrance, refractions

    scale = exit_over_entrance() ** 2
    return [
        {"degrees": degrees, "tangential": round(scale * tangential, 4), "sagittal": round(scale * sagittal, 4)}
        for degrees, (tangential, sagittal) in zip(DEGREES, refractions(), strict=True)
    ]


def main() -> None:
    warnings.simplefilter("ignore")  # the libraries' own
    cones = [
        {"side": side, "mm": mm, "thousands": count}
        for side, counts in CONES.items()
        for mm, count in zip(CONES_MM, counts, strict=True)
    ]
    found = {
        "pupils": pupils(),
        "lenses": lenses(),
        "chromatic": chromatic(),
        "glare": glare(),
        "cones": cones,
        "off_axis": off_axis(),
    }
    parts = [f'"{name}": [\n' + ",\n".join(json.dumps(row) for row in rows) + "\n]" for name, rows in found.items()]
    Path(__file__).with_suffix(".json").write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
