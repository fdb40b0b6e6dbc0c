"""Makes prysm_reference.json: transfers of pupils by another library, prysm, which transforms grids.

    pip install prysm==0.21.1 && python tests/eye/prysm_reference.py

It goes its own way from wavefront to transfer, on 1024 x 1024 points; its pupil's rim has steps, so that it is right to
about 0.0001. The library is no dependency: the tests read what it said.
"""

import json
from pathlib import Path

import numpy as np

SAMPLES = 1024
EFL = 1000.0  # mm; any: only angles are kept
CASES = (  # pupil (m), wavelength (nm), defocus (D), Zernike terms (n, m, micrometres), Stiles-Crawford (1/mm^2)
    (0.002, 450.0, 0.0, (), 0.0),
    (0.003, 555.0, 0.25, (), 0.0),
    (0.004, 580.0, 0.5, (), 0.0),
    (0.004, 450.0, 1.0, (), 0.0),
    (0.006, 650.0, -0.75, (), 0.0),
    (0.006, 555.0, 2.0, (), 0.0),
    (0.004, 555.0, 0.25, ((3, 1, 0.1), (4, 0, 0.08)), 0.0),
    (0.005, 555.0, -0.25, ((2, -2, 0.15), (3, -1, -0.12), (3, 3, 0.1)), 0.05),
)


def transfer(pupil: float, nm: float, defocus: float, terms, rho: float):
    """Complex transfer on a grid of frequencies (cycles per degree), and their spacing."""
    from prysm import coordinates, geometry, otf, polynomials, propagation

    mm = 1e3 * pupil
    x, y = coordinates.make_xy_grid(SAMPLES, diameter=mm * (1 + 1 / SAMPLES))
    r, t = coordinates.cart_to_polar(x, y)
    amplitude = geometry.circle(mm / 2, r) * 10 ** (-rho * r**2 / 2)
    height = 500 * defocus * (1e-3 * r) ** 2 * 1e3  # D r^2 / 2, in micrometres
    for n, m, coefficient in terms:
        height = height + coefficient * polynomials.zernike_nm(n, m, 2 * r / mm, t, norm=True)
    wave = propagation.Wavefront.from_amp_and_phase(amplitude, 1e3 * height, nm / 1e3, x[0, 1] - x[0, 0])
    spread = wave.focus(EFL, Q=2).intensity
    found = otf.otf_from_psf(spread.data, spread.dx)
    return found.data, found.dx * EFL * np.pi / 180


def main() -> None:
    rows = []
    for pupil, nm, defocus, terms, rho in CASES:
        data, spacing = transfer(pupil, nm, defocus, terms, rho)
        middle = SAMPLES
        cutoff = np.pi / 180 * pupil / (nm * 1e-9)
        steps = np.unique(np.round(np.linspace(0, 0.95, 25) ** 1.5 * cutoff / spacing).astype(int))
        for turn in ((0, 1), (1, 0), (1, 1)):
            places = [(s * turn[0], s * turn[1]) for s in steps if s * sum(turn) < 1.3 * cutoff / spacing]
            values = [complex(data[middle + i, middle + j]) for i, j in places]
            rows.append(
                {
                    "pupil_diameter": pupil,
                    "wavelength_nm": nm,
                    "defocus": defocus,
                    "aberrations": terms,
                    "stiles_crawford": rho,
                    "frequency_y_cpd": [round(i * spacing, 6) for i, _ in places],
                    "frequency_x_cpd": [round(j * spacing, 6) for _, j in places],
                    "real": [round(value.real, 6) for value in values],
                    "imaginary": [round(value.imag, 6) for value in values],
                }
            )
    text = "[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]\n"
    Path(__file__).with_suffix(".json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
