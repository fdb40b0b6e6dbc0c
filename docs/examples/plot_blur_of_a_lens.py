"""
The blur of a lens
==================

Blur grows with the distance from the plane of focus: in dioptres, evenly on both sides. This is Eq. 1 of the
paper, drawn for two apertures of one lens.
"""

# %%
# A 50 mm lens, focused at 1 m. In dioptres (1 / metres) blur is ``(aperture / 2) x |defocus|``.

import matplotlib.pyplot as plt
import numpy as np

from focalgradient import Lens

distance = np.geomspace(0.4, 10, 200)
fig, axes = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
for f_number, colour in ((4, "#d55e00"), (16, "#0072b2")):
    lens = Lens(focal_length=0.050, f_number=f_number, focus_distance=1.0)
    arcmin = 60 * np.degrees(lens.blur_radius(distance))
    for ax, place in zip(axes, (distance, 1 / distance), strict=True):
        ax.plot(place, arcmin, color=colour, label=f"f/{f_number}")
axes[0].set(xscale="log", xlabel="distance (m)", ylabel="radius of the blur disc (arcmin)")
axes[1].set(xlabel="vergence (D)")
axes[0].legend()

# %%
# Blur alone does not say on which side of the plane of focus a point lies: two distances have the same blur.

lens = Lens(focal_length=0.050, f_number=4, focus_distance=1.0)
print([round(float(lens.distance_from_blur(0.003, side)), 3) for side in ("nearer", "beyond")], "metres")
