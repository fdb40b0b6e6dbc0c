"""
A camera's true f-number
========================

The f-number marked on a lens can be off by a tenth, and depth from blur is off by as much. Photographs of a dark
square at known distances show the blur that the lens really has. Here the camera is simulated: it is marked
f/5.6 and is f/6.0.
"""

# %%
# The target at four distances, with 0.3 % of noise. The lens is focused at 0.85 m.

import matplotlib.pyplot as plt
import numpy as np

from focalgradient import Lens, cast
from focalgradient.calibration import Priors, Reading, calibrate, cross_validate, read_target
from focalgradient.plotting import draw_view
from focalgradient.render import noisy
from focalgradient.scenes import Plane, Scene, Texture

lens = Lens(focal_length=0.025, f_number=6.0, focus_distance=0.85)
pitch = 8e-6  # m
pixel = pitch / lens.sensor_distance  # rad
facing = (0.0, 0.0, -1.0)
distances = (0.45, 0.6, 1.2, 2.0)
views = []
for seed, distance in enumerate(distances):
    sheet = Plane((0, 0, distance), facing, Texture(mean=0.7, contrast=0))
    side = 90 * pixel * distance  # 90 pixels on each view
    square = Plane((0, 0, 0.9999 * distance), facing, Texture(mean=0.05, contrast=0), size=(side, side))
    views.append(noisy(cast(Scene((sheet, square)), lens, (144, 192), pixel).view, 0.003, seed))

fig, axes = plt.subplots(1, 4, figsize=(10, 2.2), layout="constrained")
for ax, view, distance in zip(axes, views, distances, strict=True):
    draw_view(ax, view, f"{distance:g} m")

# %%
# Along the edges blur is the width of a Gaussian. The fit also needs prior knowledge: the focus to a
# few per cent, the place of the lens's centre to 2 mm.

readings = []
for distance, view in zip(distances, views, strict=True):
    width, sd = read_target(view)  # pixels
    readings.append(Reading(distance, 5.6, 0.85, width * pitch, 2 * width * sd * pitch**2))
priors = Priors(f_number_sd=0.1, offset_sd=0.002, distance_sd=0.001)
camera = calibrate(readings, 0.025, pitch, priors)
print(camera.summary())

# %%
# The width of an edge gives k over the f-number only. The prior of k separates the two, so that
# each has an error of 4 to 5 %. Depth from edges needs their ratio alone. The test: each distance is predicted from
# the photographs at the other distances.

predicted = cross_validate(readings, 0.025, pitch, priors)
for distance, found in zip(distances, predicted, strict=True):
    print(f"{distance:g} m: predicted {found.distance:.3f} m")
fig, ax = plt.subplots(figsize=(4.5, 3.2), layout="constrained")
vergence = np.linspace(0.4, 2.4, 100)
for stop, label in ((5.6, "as marked"), (camera.f_numbers[5.6], "calibrated"), (6.0, "true")):
    one = Lens(0.025, stop, 0.85)
    ax.plot(vergence, one.blur_radius(1 / vergence) / pixel, "--" if label == "true" else "-", label=label)
ax.set(xlabel="vergence of the target (D)", ylabel="radius of the blur disc (pixels)")
ax.legend()
