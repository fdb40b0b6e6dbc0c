"""Video: reading and writing of movies frame by frame, pairing of alternating frames, and depth as video.

Frames are numbered from 0 by the file's clock; unusable frames are reported as `Skipped`.
"""

import os

# Decoding errors are reported as skipped frames, not on standard error; OpenCV reads this variable once.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

from focalgradient.video.depth_stream import DepthFrame, DepthStream, StreamCounts, write_depth
from focalgradient.video.depth_video import Scale, ValuesFile, VideoFile, write_light
from focalgradient.video.pairing import PLAIN, Pair, alternation, pairs
from focalgradient.video.reading import (
    Frame,
    Skipped,
    Source,
    ahead,
    check_frames,
    luminance,
    radiance_levels,
    read_movie,
)
from focalgradient.video.writing import check_ending, save_movie, write_frames

__all__ = [
    "PLAIN",
    "DepthFrame",
    "DepthStream",
    "Frame",
    "Pair",
    "Scale",
    "Skipped",
    "Source",
    "StreamCounts",
    "ValuesFile",
    "VideoFile",
    "ahead",
    "alternation",
    "check_ending",
    "check_frames",
    "luminance",
    "pairs",
    "radiance_levels",
    "read_movie",
    "save_movie",
    "write_depth",
    "write_frames",
    "write_light",
]
