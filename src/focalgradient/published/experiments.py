"""The published experiments, by their key in the bibliography.

Numbers that no source at hand prints are left out; a direction is then all that is compared.
"""

from __future__ import annotations

from functools import partial
from math import inf

from focalgradient.published.ask import (
    blurred_nearer,
    detection,
    dip,
    discrimination,
    gain_ratio,
    phase_difference,
    successive_discrimination,
    threshold_ratio,
    weber_fraction,
)
from focalgradient.published.record import Finding, Published
from focalgradient.stimuli import PAPERS

__all__ = ["EXPERIMENTS"]

DISTANCE = (
    "Not asked in this table yet: `DistanceOfFixated` answers in metres, given the layout that other cues suggest."
)
ONE_EYE = "This observer has one eye: it does not see disparity."
OWN_WEBER = "Not independent: the observer's own Weber fraction was taken from this range."
OWN_BLUR = (
    "Pedestals of 0 to 4 arcmin. The observer's intrinsic blur was taken from thresholds that the review collects."
)
PAIRED = (
    "Not independent: that the nearer side owns the border's blur is what the observer assumes after these papers, but "
    "it reads the blurs from the pixels. Textures and the blur of 4 arcmin are our choice."
)
KRUGER = "Three pairs of trials of 6 s; the eye of `eye.accommodate` with the observer's pupil."

_RECORDS = (
    Published(
        key="pentland1987",
        citation="Pentland 1987, IEEE PAMI 9, first experiment",
        doi="",
        design="Pictures of naturalistic scenes with focal gradients of several magnitudes were rated for "
        "three-dimensionality while people fixated the nearest or the farthest object.",
        conditions=("nearest fixated", "farthest fixated"),
        findings=(
            Finding(
                quantity="rating at the largest aperture over the pinhole, nearest fixated",
                units="1",
                printed="increases strongly with increasing magnitude of the focal gradient",
                low=1.0,
                high=inf,
                source="full text",
                remark="Not asked in this table: its figure fig3 asks observers who rate whole sets of pictures.",
            ),
            Finding(
                quantity="rating at the largest aperture over the pinhole, farthest fixated",
                units="1",
                printed="no increase in subjective impression of depth results",
                low=-inf,
                high=1.0,
                source="full text",
                remark="Not asked in this table: its figure fig3 asks observers who rate whole sets of pictures.",
            ),
        ),
    ),
    Published(
        key="pentland1987-necker",
        citation="Pentland 1987, IEEE PAMI 9, second experiment",
        doi="",
        design="A wireframe cube that rotates in perspective was seen as rigid or as wobbling, with and without a "
        "focal gradient that favours the nonrigid reading.",
        conditions=("no focal gradient", "gradient that favours the nonrigid reading"),
        findings=(
            Finding(
                quantity="share of time nonrigid with the gradient less that without",
                units="1",
                printed="seen almost as often as the rigid one",
                low=0.0,
                high=inf,
                source="full text",
                remark="Not asked in this table: the figure necker asks observers who watch the whole experiment.",
            ),
        ),
    ),
    Published(
        key="mather1996",
        citation="Mather 1996, Proc. R. Soc. Lond. B 263",
        doi="",
        design="Of two textured regions, one sharp and one blurred, people said which is nearer, with a sharp or a "
        "blurred border between them.",
        conditions=tuple(PAPERS["mather1996"].conditions),
        findings=(
            Finding(
                quantity="share in which the blurred side looks nearer, border blurred",
                units="1",
                printed="the border's blur establishes the order (abstract); a blurred border puts the blurred side "
                "in front",
                low=0.5,
                high=inf,
                source="memory",
                ask=partial(blurred_nearer, paper="mather1996", border="blurred"),
                remark=PAIRED,
            ),
            Finding(
                quantity="share in which the blurred side looks nearer, border sharp",
                units="1",
                printed="the border's blur establishes the order (abstract); a sharp border puts the sharp side in "
                "front",
                low=-inf,
                high=0.5,
                source="memory",
                ask=partial(blurred_nearer, paper="mather1996", border="sharp"),
                remark=PAIRED,
            ),
        ),
    ),
    Published(
        key="mather2002",
        citation="Mather and Smith 2002, Perception 31",
        doi="",
        design="Of two random textures at a sinusoidal border, one blurred, people said which is nearer; blur "
        "discrimination thresholds were measured with similar textures.",
        conditions=tuple(PAPERS["mather2002"].conditions),
        findings=(
            Finding(
                quantity="Weber fraction of blur in textures",
                units="1",
                printed="0.28 to 0.56",
                low=0.28,
                high=0.56,
                source="abstract",
                ask=partial(weber_fraction, pedestal=4.0),
                remark=f"{OWN_WEBER} The pedestal of 4 arcmin is our choice.",
            ),
            Finding(
                quantity="share in which the blurred side looks nearer, border blurred",
                units="1",
                printed="blur variation alone is sufficient to determine the apparent depth ordering (abstract); its "
                "direction",
                low=0.5,
                high=inf,
                source="memory",
                ask=partial(blurred_nearer, paper="mather2002", border="blurred"),
                remark=PAIRED,
            ),
            Finding(
                quantity="share in which the blurred side looks nearer, border sharp",
                units="1",
                printed="blur variation alone is sufficient to determine the apparent depth ordering (abstract); its "
                "direction",
                low=-inf,
                high=0.5,
                source="memory",
                ask=partial(blurred_nearer, paper="mather2002", border="sharp"),
                remark=PAIRED,
            ),
        ),
    ),
    Published(
        key="marshall1996",
        citation="Marshall, Burbeck, Ariely, Rolland and Martin 1996, JOSA A 13",
        doi="",
        design="People said which of two adjacent textured regions is nearer, while the blur of either region and of "
        "the edge between them varied.",
        conditions=tuple(PAPERS["marshall1996"].conditions),
        findings=(
            Finding(
                quantity="share in which the blurred side looks nearer, border blurred",
                units="1",
                printed="the region whose blur the edge has looks nearer",
                low=0.5,
                high=inf,
                source="memory",
                ask=partial(blurred_nearer, paper="marshall1996", border="blurred"),
                remark=PAIRED,
            ),
            Finding(
                quantity="share in which the blurred side looks nearer, border sharp",
                units="1",
                printed="the region whose blur the edge has looks nearer",
                low=-inf,
                high=0.5,
                source="memory",
                ask=partial(blurred_nearer, paper="marshall1996", border="sharp"),
                remark=PAIRED,
            ),
        ),
    ),
    Published(
        key="watson2011",
        citation="Watson and Ahumada 2011, J. Vision 11(5)",
        doi="",
        design="Review of thresholds for an increment of blur of an edge as a function of the reference blur.",
        conditions=tuple(PAPERS["watson2011"].conditions),
        findings=(
            Finding(
                quantity="smallest threshold over that without a pedestal",
                units="1",
                printed="thresholds fall to a minimum and rise again (a dipper)",
                low=-inf,
                high=1.0,
                source="memory",
                ask=dip,
                remark=OWN_BLUR,
            ),
        ),
    ),
    Published(
        key="wang2005",
        citation="Wang and Ciuffreda 2005, foveal blur discrimination of the human eye",
        doi="",
        design="Defocus grew by the ascending method of limits, accommodation paralysed, until blur was first noticed "
        "and then until each further change was.",
        conditions=("detection", "discrimination"),
        findings=(
            Finding(
                quantity="detection threshold of defocus",
                units="D",
                printed="0.87 +- 0.18 (SEM)",
                low=0.51,
                high=1.23,
                source="abstract",
                ask=detection,
                remark="The pupil is the observer's.",
            ),
            Finding(
                quantity="mean of subsequent discrimination thresholds",
                units="D",
                printed="0.48 +- 0.006 (SEM)",
                low=0.468,
                high=0.492,
                source="abstract",
                ask=successive_discrimination,
                remark="Four steps; the pupil is the observer's.",
            ),
        ),
    ),
    Published(
        key="jacobs1989",
        citation="Jacobs, Smith and Chan 1989, Optom. Vis. Sci. 66, 545-553",
        doi="",
        design="People adjusted defocus, in the picture or by lenses, to the first perceptible blur of targets of "
        "several sizes, and to the least change of blur of a blurred target.",
        conditions=("blur threshold", "threshold of perceived change in blur"),
        findings=(
            Finding(
                quantity="least noticeable defocus",
                units="D",
                printed="0.10 (targets near acuity) to about 0.18 (larger targets)",
                low=0.10,
                high=0.18,
                source="abstract",
                ask=detection,
                remark="The pupil is the observer's; it does not depend on the target's size.",
            ),
            Finding(
                quantity="least perceived change upon 1 D",
                units="D",
                printed="0.05 to 0.07",
                low=0.05,
                high=0.07,
                source="abstract",
                ask=partial(discrimination, pedestal=1.0),
                remark="The initial defocus of 1 D is our choice.",
            ),
            Finding(
                quantity="least perceived change upon 2 D over that upon 0.5 D",
                units="1",
                printed="independent of the initial defocus level",
                low=0.8,
                high=1.25,
                source="abstract",
                ask=partial(threshold_ratio, pedestal=2.0, other=0.5),
                remark="Both levels and the range, of which none is printed, are our choice.",
            ),
        ),
    ),
    Published(
        key="held2010",
        citation="Held, Cooper, O'Brien and Banks 2010, ACM Trans. Graphics 29(2), 19",
        doi="10.1145/1731047.1731057",
        design="People judged the distance of a city in pictures with blur that is consistent with a simulated "
        "distance, a planar gradient along or across it, or none.",
        conditions=tuple(PAPERS["held2010"].conditions),
        findings=(
            Finding(
                quantity="judged distance, consistent blur over no blur",
                units="1",
                printed="blur changes the apparent distance and scale (abstract); nearer with more blur",
                low=-inf,
                high=1.0,
                source="memory",
                remark=DISTANCE,
            ),
        ),
    ),
    Published(
        key="held2012",
        citation="Held, Cooper and Banks 2012, Current Biology 22, 426-431",
        doi="10.1016/j.cub.2012.01.033",
        design="On a display of several focal distances people discriminated depth by blur, by disparity or by both, "
        "near fixation and away from it.",
        conditions=("blur", "disparity", "both"),
        findings=(
            Finding(
                quantity="threshold by blur over that by disparity, away from fixation",
                units="1",
                printed="blur was indeed more precise away from fixation",
                low=-inf,
                high=1.0,
                source="abstract",
                remark=ONE_EYE,
            ),
            Finding(
                quantity="threshold by blur over that by disparity, near fixation",
                units="1",
                printed="disparity was more precise near fixation",
                low=1.0,
                high=inf,
                source="abstract",
                remark=ONE_EYE,
            ),
        ),
    ),
    Published(
        key="langer2015",
        citation="Langer and Siciliano 2015, Vision Research 107, 15-21",
        doi="",
        design="The experiment of Held, Cooper and Banks with rendered blur on a common 3D display.",
        conditions=("near fixation", "away from fixation"),
        findings=(
            Finding(
                quantity="weight of blur away from fixation less that near it",
                units="1",
                printed="subjects did not rely more on blur to discriminate depth at distances far from fixation",
                low=-inf,
                high=0.0,
                source="abstract",
                remark=ONE_EYE,
            ),
        ),
    ),
    Published(
        key="vishwanath2010",
        citation="Vishwanath and Blaser 2010, J. Vision 10(10), 26",
        doi="",
        design="People judged the distance of surfaces with and without a vertical or a horizontal gradient of blur.",
        conditions=tuple(PAPERS["vishwanath2010"].conditions),
        findings=(
            Finding(
                quantity="judged distance with the gradient of blur over that without",
                units="1",
                printed="surfaces with blur gradients were judged as significantly closer",
                low=-inf,
                high=1.0,
                source="abstract",
                remark=DISTANCE,
            ),
        ),
    ),
    Published(
        key="maiello2015",
        citation="Maiello, Chessa, Bex and Solari 2015, PLoS ONE 10",
        doi="",
        design="People said which of two patches of light-field photographs is farther, with pictorial cues, blur and "
        "disparity added separately.",
        conditions=("pictorial", "blur", "disparity", "their combinations"),
        findings=(
            Finding(
                quantity="sensitivity to depth with blur less that without",
                units="d'",
                printed="blur cues impaired sensitivity",
                low=-inf,
                high=0.0,
                source="abstract",
                remark="It looks without a layout, and so has no pictorial cues that blur could impair.",
            ),
        ),
    ),
    Published(
        key="maiello2017",
        citation="Maiello, Walker, Bex and Vera-Diaz 2017, J. Vision 17(5), 3",
        doi="10.1167/17.5.3",
        design="39 people said which quadrant of an annulus of dead leaves at 0, 4, 8 or 12 degrees is more blurred, "
        "upon pedestals of blur.",
        conditions=tuple(PAPERS["maiello2017"].conditions),
        findings=(
            Finding(
                quantity="smallest threshold over that without a pedestal, fovea",
                units="1",
                printed="dipper shaped blur discrimination threshold function",
                low=-inf,
                high=1.0,
                source="abstract",
                ask=dip,
                remark=OWN_BLUR,
            ),
            Finding(
                quantity="intrinsic blur at 12 degrees over that at 0",
                units="1",
                printed="intrinsic blur increased for retinal eccentricities beyond 4 degrees",
                low=1.0,
                high=inf,
                source="abstract",
                remark="This observer has one intrinsic blur for all eccentricities.",
            ),
        ),
    ),
    Published(
        key="kruger1993",
        citation="Kruger, Mathews, Aggarwala and Sanchez 1993, Vision Research 33, 1397-1411",
        doi="10.1016/0042-6989(93)90046-y",
        design="Accommodation of 25 people was measured while a target moved sinusoidally from 1.5 to 2.5 D at 0.2 Hz "
        "in light of 590 nm, or in white with chromatic aberration normal, neutralised or reversed.",
        conditions=("white", "monochromatic", "neutralised", "reversed"),
        findings=(
            Finding(
                quantity="gain in light of 590 nm over that in white",
                units="1",
                printed="gain decreases substantially",
                low=-inf,
                high=1.0,
                source="abstract",
                ask=partial(gain_ratio, light="monochromatic"),
                remark=KRUGER,
            ),
            Finding(
                quantity="gain with aberration neutralised over that in white",
                units="1",
                printed="gain decreases substantially",
                low=-inf,
                high=1.0,
                source="abstract",
                ask=partial(gain_ratio, light="neutralised"),
                remark=KRUGER,
            ),
            Finding(
                quantity="phase in light of 590 nm less that in white",
                units="degrees",
                printed="phase-lag increases",
                low=-inf,
                high=0.0,
                source="abstract",
                ask=partial(phase_difference, light="monochromatic"),
                remark=KRUGER,
            ),
            Finding(
                quantity="phase with aberration neutralised less that in white",
                units="degrees",
                printed="phase-lag increases",
                low=-inf,
                high=0.0,
                source="abstract",
                ask=partial(phase_difference, light="neutralised"),
                remark=KRUGER,
            ),
            Finding(
                quantity="gain with aberration reversed over that in white",
                units="1",
                printed="severely disrupts accommodation",
                low=-inf,
                high=0.5,
                source="abstract",
                ask=partial(gain_ratio, light="reversed"),
                remark=f"{KRUGER} A gain below half is our reading of severe.",
            ),
        ),
    ),
    Published(
        key="konrad2016",
        citation="Konrad, Cooper and Wetzstein 2016, CHI",
        doi="10.1145/2858036.2858140",
        design="People in a near-eye display ordered depth, among other tasks, with conventional, focus-tunable and "
        "monovision optics.",
        conditions=("conventional", "focus-tunable", "monovision"),
        findings=(
            Finding(
                quantity="share right with focus-tunable optics less that with conventional ones, near distances",
                units="1",
                printed="improve user performance in terms of reaction times and accuracy, particularly for nearby "
                "simulated distances",
                low=0.0,
                high=inf,
                source="abstract",
                remark="`depth_order_observer` is fitted to these very people, so its answer would be no prediction; "
                "the observer that looks has one eye and pictures of one focus.",
            ),
        ),
    ),
)

EXPERIMENTS: dict[str, Published] = {one.key: one for one in _RECORDS}
"""By key."""
