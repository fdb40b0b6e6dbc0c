"""What is in the world: surfaces and what they are painted with, and scenes made of them.

The camera stands at the origin and looks along +z; x points right, y down; lengths are in metres. A scene knows nothing
of optics or pixels: the same scene through two lenses is the same world.
"""

from focalgradient.scenes.bottle import bottle
from focalgradient.scenes.factories import plane, slant, spheres, step
from focalgradient.scenes.landscape import terrain
from focalgradient.scenes.named import SCENES, scene
from focalgradient.scenes.naturalistic import naturalistic
from focalgradient.scenes.necker import NeckerCube, departure_from_rigid
from focalgradient.scenes.objects import Mark, Mesh, Plane, Scene, Sky, Sphere
from focalgradient.scenes.room import room
from focalgradient.scenes.texture import Texture

__all__ = [
    "SCENES",
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
    "slant",
    "spheres",
    "step",
    "terrain",
]
