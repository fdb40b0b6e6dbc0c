"""Scene geometry and materials.

The camera is at the origin and looks along +z; x points right, y down; lengths are in metres. A scene is independent of
optics and pixels, so that views through two lenses show the same scene.
"""

from focalgradient.scenes.bottle import bottle
from focalgradient.scenes.factories import plane, slant, spheres, step
from focalgradient.scenes.landscape import terrain
from focalgradient.scenes.named import SCENES, SCENES_IN_DEPTH, scene, scene_about
from focalgradient.scenes.naturalistic import naturalistic
from focalgradient.scenes.necker import NeckerCube, departure_from_rigid
from focalgradient.scenes.objects import Mark, Mesh, Plane, Scene, Sky, Sphere
from focalgradient.scenes.room import room
from focalgradient.scenes.texture import Texture

__all__ = [
    "SCENES",
    "SCENES_IN_DEPTH",
    "Mark",
    "Mesh",
    "NeckerCube",
    "Plane",
    "Scene",
    "Sky",
    "Sphere",
    "Texture",
    "bottle",
    "departure_from_rigid",
    "naturalistic",
    "plane",
    "room",
    "scene",
    "scene_about",
    "slant",
    "spheres",
    "step",
    "terrain",
]
