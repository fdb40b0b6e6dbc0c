"""What is in the world: textured planes and spheres, and scenes made of them.

The camera stands at the origin and looks along +z; x points right, y down; lengths are in metres. A scene knows nothing
of optics or pixels: the same scene through two lenses is the same world.
"""

from focalgradient.scenes.factories import plane, slant, spheres
from focalgradient.scenes.objects import Plane, Scene, Sphere
from focalgradient.scenes.texture import Texture

__all__ = ["Plane", "Scene", "Sphere", "Texture", "plane", "slant", "spheres"]
