"""The two eyes of a person: position, focus, and disparity of points.

Both eyes accommodate equally, whatever each would need (consensual accommodation), and their aberrations are mirror
images of each other on average (Porter, Guirao, Cox & Williams 2001, J. Opt. Soc. Am. A 18, 1793). Views are made by
`focalgradient.stereo`, each through the optics of its eye.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.binocular import INTEROCULAR
from focalgradient.errors import check_fields, check_finite, check_number
from focalgradient.eye.model_eye import Eye
from focalgradient.eye.protocol import check_eye
from focalgradient.eye.refraction import Correction, Refraction, worn_of
from focalgradient.quantities import Range

__all__ = ["TwoEyes"]


@dataclass(frozen=True, slots=True)
class TwoEyes:
    """Left and right eye of a person.

    Parameters
    ----------
    left, right
        The eyes (`Eye`, or a class of your own).
    interocular
        Distance in metres between their nodal points.

    Raises
    ------
    InputError
        If one is not an eye, or the distance is out of range.

    Examples
    --------
    Eyes that converge on something at 40 cm turn by 9 degrees to each other; 1 m then has a disparity of -5.4 degrees.

    >>> pair = TwoEyes.of(Eye(0.004, 2.5))
    >>> round(float(np.degrees(pair.convergence(2.5))), 1), round(float(np.degrees(pair.disparity(1.0, 2.5))), 1)
    (9.0, -5.4)
    """

    left: Any
    right: Any
    interocular: Annotated[float, Range("metres", 0.04, 0.08)] = INTEROCULAR

    def __post_init__(self) -> None:
        for name in ("left", "right"):
            check_eye(name, getattr(self, name))
        check_fields(self)

    @classmethod
    def of(cls, right: Any, *, interocular: float = INTEROCULAR) -> TwoEyes:
        """Return two eyes, the left one the mirror image of the `right`."""
        check_eye("right", right, "mirrored")
        return cls(right.mirrored(), right, interocular)

    @classmethod
    def of_person(
        cls,
        left: Refraction | str,
        right: Refraction | str,
        *,
        looking_at: float = 0.0,
        age: float | None = None,
        correction: Correction | str | None = None,
        pupil_diameter: float | None = None,
        interocular: float = INTEROCULAR,
    ) -> TwoEyes:
        """Return two eyes with a prescription each, which accommodate equally: by the smaller response needed.

        Parameters
        ----------
        left, right
            Prescriptions (`Refraction`).
        looking_at
            Vergence in dioptres of the point fixated.
        age, correction, pupil_diameter
            As of `Eye`, of both.
        interocular
            Metres.

        Examples
        --------
        Without glasses the left eye of -1 D needs no accommodation to see 1 m sharply; the right one stays far-sighted.

        >>> pair = TwoEyes.of_person("-1.00", "plano", looking_at=1.0, pupil_diameter=0.004)
        >>> round(pair.left.focus_vergence, 1), round(pair.right.focus_vergence, 1)
        (1.0, 0.0)
        """
        first, second = (
            prescription if isinstance(prescription, Refraction) else Refraction.parse(prescription)
            for prescription in (left, right)
        )
        worn = worn_of(correction)
        response = min(worn.response(refraction, looking_at, age) for refraction in (first, second))

        def eye(refraction: Refraction) -> Eye:
            return Eye(pupil_diameter, refraction=refraction, age=age, response=response, correction=worn)

        return cls(eye(first), eye(second), interocular)

    def accommodated(self, change: float) -> TwoEyes:
        """Return the eyes after both have accommodated by `change` dioptres more."""
        check_number("change", change, "dioptres")
        left, right = (eye.refocused(eye.focus_vergence + change) for eye in (self.left, self.right))
        return replace(self, left=left, right=right)

    def convergence(self, vergence: ArrayLike) -> FloatArray:
        """Return the convergence angle (rad) for a point straight ahead at each `vergence` (D, any shape)."""
        return np.asarray(2 * np.arctan(self.interocular * check_finite("vergence", vergence, "dioptres") / 2))

    def disparity(self, vergence: ArrayLike, fixated: float) -> FloatArray:
        """Return the absolute disparity (rad) of points straight ahead at each `vergence` (D, any shape).

        Convergence on the point less that on the point `fixated` (D): positive for nearer points.
        """
        return np.asarray(self.convergence(vergence) - self.convergence(fixated))
