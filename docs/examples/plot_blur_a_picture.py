"""
A picture through any lens
==========================

A picture whose depth is known is given the blur of a lens, focused here or there: near things blur over far
ones.
"""

# %%
# A picture of our own: a fine texture, the middle of which is near.

import matplotlib.pyplot as plt
import numpy as np

import focalgradient as fg

rng = np.random.default_rng(1)
picture = np.clip(0.5 + 0.2 * rng.standard_normal((160, 240)), 0.05, 1)
rows, columns = np.indices(picture.shape)
middle = np.hypot(rows - 80, columns - 120) < 45
distance = np.where(middle, 0.6, 2.0)  # m

# %%
# The same picture through a 25 mm lens at f/2.8, focused on either.

fig, axes = plt.subplots(1, 2, figsize=(8, 2.8), layout="constrained")
for ax, focus in zip(axes, (0.6, 2.0), strict=True):
    view = fg.blur(picture, distance, fg.Lens(0.025, 2.8, focus), pixel_angle=3e-4)
    ax.imshow(view.image, cmap="gray", vmin=0, vmax=1)
    ax.set(title=f"focused at {focus:g} m", xticks=[], yticks=[])
