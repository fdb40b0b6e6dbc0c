"""
Stimuli of the field, with their profiles of blur
=================================================

Each function of ``fg.stimuli`` draws a picture of the blur that was set, and gives the true blur and the true
distance of every pixel with it. Under each picture: the standard deviation of the blur along the white line.
"""

# %%
# The picture is linear light; it is shown with the curve of sRGB, as on a display.

import matplotlib.pyplot as plt
import numpy as np

import focalgradient as fg
from focalgradient.srgb import linear_to_srgb
from focalgradient.stimuli import Stimulus

BLUE = "#0072B2"


def show(title: str, one: Stimulus, picture: plt.Axes, profile: plt.Axes, down: bool, at: float) -> None:
    """The picture, and the blur along a row or down a column, at a share of the picture's height or width."""
    height, width = one.shape
    degrees = np.degrees(one.pixel_angle)
    extent = np.array([-width, width, height, -height]) * degrees / 2
    picture.imshow(linear_to_srgb(one.picture), cmap="gray", vmin=0, vmax=1, extent=tuple(extent))
    line = (at - 0.5) * degrees * (width if down else height)
    (picture.axvline if down else picture.axhline)(line, color="white", lw=0.8, alpha=0.8)
    picture.set_title(title, fontsize=9)
    picture.set(xticks=[], yticks=[])
    blur = one.blur_arcmin[:, int(at * width)] if down else one.blur_arcmin[int(at * height)]
    place = (np.arange(len(blur)) - (len(blur) - 1) / 2) * degrees
    profile.plot(place, blur, color=BLUE, lw=1.5)
    profile.set(xlim=(place[0], place[-1]), ylim=(0, 1.15 * max(float(blur.max()), 0.1)))
    profile.set_xlabel(f"{'downwards' if down else 'to the right'} (degrees)", fontsize=8)
    for ax in (picture, profile):
        ax.tick_params(labelsize=8)


def sheet(stimuli: dict[str, tuple[Stimulus, bool]], at: float = 0.5) -> None:
    """A row of pictures over a row of profiles."""
    _, axes = plt.subplots(
        2, len(stimuli), figsize=(9.5, 3.9), height_ratios=(2.2, 1), layout="constrained", squeeze=False
    )
    for (title, (one, down)), (picture, profile) in zip(stimuli.items(), axes.T, strict=True):
        show(title, one, picture, profile, down, at)
    axes[1, 0].set_ylabel("blur (arcmin)", fontsize=8)


# %%
# A border belongs to the side whose blur it has (Mather 1996; Marshall et al. 1996; Mather and Smith 2002): here the
# left side is in front, then the right one, then the left one with the blur that optics give its edge.

border = fg.stimuli.texture_border
sheet(
    {
        "sharp border": (border(left_blur_arcmin=0, right_blur_arcmin=4, border_blur_arcmin=0), False),
        "blurred border": (border(left_blur_arcmin=0, right_blur_arcmin=4, border_blur_arcmin=4), False),
        "near side blurred": (border(left_blur_arcmin=4, right_blur_arcmin=0, near="left"), False),
    }
)

# %%
# Dead leaves, each with one of four blurs (Taylor and Bex 2015), in random order and in the order of depth; and an edge
# with a pedestal of blur and an increment (Watson and Ahumada 2011).

leaves = fg.stimuli.dead_leaves
sheet(
    {
        "leaves, random order": (leaves(), False),
        "leaves, order of depth": (leaves(order="depth"), False),
        "edge, 4 + 1 arcmin": (fg.stimuli.blurred_edge(pedestal_arcmin=4, increment_arcmin=1), False),
    }
)

# %%
# Surfaces through a lens: only blur says that they are not flat; and the cube, fixated at its nearest vertex.

sheet(
    {
        "plane, slant 60 degrees": (fg.stimuli.slanted_plane(pupil_mm=12), True),
        "corrugated plane": (fg.stimuli.corrugated_plane(pupil_mm=12), True),
        "cube, nearest vertex fixated": (fg.stimuli.fixated_cube(), False),
    }
)

# %%
# A town as the eye would see a model of it 15 cm away (Held et al. 2010), and the control, whose planar gradient does
# not agree with the town; and a wide field, blurred 8 degrees from its middle (Maiello et al. 2017).

sheet(
    {
        "town, as at 15 cm": (fg.stimuli.miniature(), True),
        "control: planar gradient": (fg.stimuli.miniature(gradient="horizontal"), False),
        "wide field": (fg.stimuli.wide_field(), False),
    },
    at=0.38,
)

# %%
# The record lists the controls.

fg.stimuli.replica("mather2002", "left sharp, blurred border").controlled
