"""Devices of the laboratory, one file each: response boxes, lenses, photometers, stereoscopes, trackers, triggers."""
