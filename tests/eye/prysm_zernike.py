"""Makes prysm_zernike.json: Zernike polynomials in the OSA's order by another library, prysm.

    pip install prysm==0.21.1 && python tests/eye/prysm_zernike.py

The library is no dependency: the tests read what it said.
"""

import json
from pathlib import Path

import numpy as np

PLACES = ((0.3, 0.2), (-0.5, 0.6), (0.1, -0.9), (-0.7, -0.4))


def main() -> None:
    from prysm import polynomials

    x, y = np.array(PLACES).T
    rows = []
    for index in range(36):
        n, m = polynomials.ansi_j_to_nm(index)
        values = polynomials.zernike_nm(n, m, np.hypot(x, y), np.arctan2(y, x), norm=True) * np.ones(len(PLACES))
        rows.append({"index": index, "n": int(n), "m": int(m), "values": [round(float(v), 9) for v in values]})
    text = json.dumps({"places": PLACES, "terms": rows}, indent=1) + "\n"
    Path(__file__).with_suffix(".json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
