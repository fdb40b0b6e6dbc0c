"""
Depth from two apertures
========================

Spheres on a floor before a wall, seen through f/16 and f/5.6. The comparison of the two views gives distance,
and its standard deviation, at every textured pixel.
"""

# %%
# Two views of one scene, with one per cent of noise.

import matplotlib.pyplot as plt

from focalgradient import Lens, cast, recover_depth
from focalgradient.plotting import draw_depth, draw_uncertainty, draw_view
from focalgradient.render import noisy
from focalgradient.scenes import spheres

# An ideal lens: what it has in focus is a plane.
lenses = [Lens(0.025, f_number, focus_distance=0.8, field_tolerance=0) for f_number in (16, 5.6)]
pixel = 8e-6 / lenses[0].sensor_distance  # radians
rendered = [cast(spheres(seed=5), lens, (240, 320), pixel) for lens in lenses]
views = [noisy(one.view, 0.01 * float(one.view.image.mean()), seed) for seed, one in enumerate(rendered)]

# %%
# Both are focused at 0.8 m, nearer than everything in the scene: the side of focus is given by ``near``.

depth = recover_depth(views, near=0.8)
fig, axes = plt.subplots(1, 3, figsize=(10, 3), layout="constrained")
draw_view(axes[0], views[1], "the view through f/5.6")
draw_depth(axes[1], depth, title="distance")
draw_uncertainty(axes[2], depth)
print(depth.summary())
