"""Off-axis focus of the schematic eye, compared with visisipy, which traces rays through the same surfaces.

    pip install visisipy
    python benchmarks/off_axis_of_visisipy.py

visisipy (https://github.com/MREYE-LUMC/visisipy) fits Zernike terms to a wavefront traced into the eye, over its exit
pupil; `focalgradient.eye.field_foci` follows Coddington's equations from the retina outwards. Both use the surfaces of
Escudero-Sanz & Navarro (1999) and the indices at 543 nm. visisipy's refraction is the curvature of the wavefront over
the exit pupil; in front of the eye it is scaled by the squared ratio of exit to entrance pupil diameter. visisipy
assumes a circular beam in the pupil, which off axis is narrower in the tangential plane: there the two differ.
"""

from __future__ import annotations

import warnings

from focalgradient.eye import field_foci
from focalgradient.eye.off_axis import STOP, SURFACES

PUPIL_MM, MICROMETRES = 0.5, 0.543
DEGREES = (10, 20, 30, 40)

(_, FRONT, _, CORNEA), (BACK_AT, BACK, _, AQUEOUS), (_, _, _, LENS), (LENS_END, LENS_BACK, _, VITREOUS) = SURFACES


def exit_over_entrance() -> float:
    """Return the ratio of exit to entrance pupil diameter, from paraxial rays from the centre of the stop.

    Each is the stop magnified by n u / (n' u') of such a ray (Lagrange invariant).
    """
    # inwards from the stop, which touches the lens: n' u' = n u - y (n' - n) / R at each surface
    height = AQUEOUS / LENS * (LENS_END - STOP)
    behind = AQUEOUS - height * (VITREOUS - LENS) / LENS_BACK
    # outwards, with radii of the opposite sign
    height = STOP - BACK_AT
    cornea = AQUEOUS + height * (CORNEA - AQUEOUS) / BACK
    height += cornea / CORNEA * BACK_AT
    outside = cornea + height * (1 - CORNEA) / FRONT
    return outside / behind


def refractions() -> list[tuple[float, float]]:
    """Return visisipy's tangential and sagittal vergence in focus relative to the axis, over the exit pupil (D)."""
    import visisipy
    from visisipy.models import EyeModel, NavarroGeometry
    from visisipy.models.materials import EyeMaterials, MaterialModel

    visisipy.set_backend("optiland")
    glass = [MaterialModel(refractive_index=index) for *_, index in SURFACES]
    model = EyeModel(NavarroGeometry(), EyeMaterials(*glass))
    found = [
        visisipy.analysis.refraction(
            model,
            field_coordinate=(0, degrees),
            wavelength=MICROMETRES,
            pupil_diameter=PUPIL_MM,
            use_higher_order_aberrations=False,
        )
        for degrees in (0, *DEGREES)
    ]
    middle = found[0].M
    return [(float(middle - one.M + one.J0), float(middle - one.M - one.J0)) for one in found[1:]]


def main() -> None:
    warnings.simplefilter("ignore")  # visisipy's own warnings on added fields
    scale = exit_over_entrance() ** 2
    print(f"exit over entrance pupil: {scale**0.5:.3f}")
    print("degrees  tangential D: ours  visisipy   sagittal D: ours  visisipy   astigmatism D: ours  visisipy")
    for degrees, (tangential, sagittal) in zip(DEGREES, refractions(), strict=True):
        ours, theirs = field_foci(degrees), (scale * tangential, scale * sagittal)
        print(
            f"{degrees:7} {ours[0]:19.2f} {theirs[0]:9.2f} {ours[1]:18.2f} {theirs[1]:9.2f} "
            f"{ours[0] - ours[1]:21.2f} {theirs[0] - theirs[1]:9.2f}"
        )


if __name__ == "__main__":
    main()
