"""
The Necker cube with a focal gradient
=====================================

A wire cube can be seen in two ways: as a rigid cube that turns, or depth-reversed, as a shape that changes
while it turns the other way. Blur that agrees with one reading, and not with the other, favours it. The lines
lie in the same places in all three pictures.
"""

import matplotlib.pyplot as plt
import numpy as np

from focalgradient.render import necker_frame
from focalgradient.scenes import NeckerCube

fig, axes = plt.subplots(1, 3, figsize=(9, 3.2), layout="constrained")
for ax, gradient in zip(axes, ("none", "rigid", "nonrigid"), strict=True):
    frame = necker_frame(NeckerCube(), 0.08, shape=(560, 560), pixel_angle=5e-4, gradient=gradient, aperture=0.012)
    ax.imshow(np.clip(frame, 0, 1) ** (1 / 2.2), cmap="gray")
    ax.set(title=f"gradient: {gradient}", xticks=[], yticks=[])
