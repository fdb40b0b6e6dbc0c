"""
The point spread of a measured eye
==================================

An aberrometer gives Zernike coefficients. Here an eye with some coma and spherical aberration looks at a
point at three distances: in front of, in, and beyond its plane of focus.
"""

import matplotlib.pyplot as plt
import numpy as np

from focalgradient import Eye
from focalgradient.eye import osa_index, point_spread

coefficients = np.zeros(15)  # micrometres, in the OSA's order, over a pupil of 6 mm
coefficients[osa_index(3, -1)] = 0.12
coefficients[osa_index(4, 0)] = 0.15
eye = Eye.from_zernike(coefficients, 0.005, measured_diameter=0.006)

angle = np.arange(-60, 61) * 5e-5  # rad
fig, axes = plt.subplots(1, 3, figsize=(9, 3.2), layout="constrained")
for ax, defocus in zip(axes, (-0.5, 0.0, 0.5), strict=True):
    spread = point_spread(angle, angle, eye, eye.focus_vergence - defocus)
    extent = 60 * np.degrees(angle[[0, -1, 0, -1]])
    ax.imshow(spread, cmap="gray", extent=extent, origin="lower")
    ax.set(title=f"defocus {defocus:+g} D", xlabel="arcmin")
