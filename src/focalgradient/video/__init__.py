"""Video: movies written and read frame by frame, pairs of views out of alternating frames, and depth as video.

Frames are numbered from 0 as the file's clock counts them; what cannot be used is passed on as `Skipped`.
"""

import os

# What FFmpeg finds wrong with a file is reported as skipped frames, not on standard error; it reads this once.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

from focalgradient.video.depth_video import Scale, ValuesFile, VideoFile
from focalgradient.video.pairing import PLAIN, Pair, alternation, pairs
from focalgradient.video.reading import Frame, Skipped, Source, ahead, check_frames, luminance, read_movie
from focalgradient.video.writing import check_ending, save_movie, write_frames

__all__ = [
    "PLAIN",
    "Frame",
    "Pair",
    "Scale",
    "Skipped",
    "Source",
    "ValuesFile",
    "VideoFile",
    "ahead",
    "alternation",
    "check_ending",
    "check_frames",
    "luminance",
    "pairs",
    "read_movie",
    "save_movie",
    "write_frames",
]
