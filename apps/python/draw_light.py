"""How much of the light reaches a point of a scene: soft shadows and ambient occlusion.

The light comes from some directions: those of a sky and of the ground that reflects it, all around,
and a bundle of them for a key light, which is as wide as its shadows are soft. Along each of them
the bodies are drawn into a map of depths, and a point is lit from there if nothing is before it
(Williams 1978, Casting curved shadows on curved surfaces).
"""

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkFloatArray
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow

AROUND, KEY = 36, 28  # directions
KEY_WIDTH = 0.13  # tangent of the half angle of the key light
KEY_SHARE = 0.42  # of the light on a surface that faces it, without shadows
GROUND = 0.45  # light from straight below over that from straight above
MAP = 384  # pixels


def spiral(count):
    """Evenly spread unit vectors: Fibonacci's spiral."""
    k = np.arange(count) + 0.5
    height, angle = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - height**2)
    return np.stack([flat * np.cos(angle), height, flat * np.sin(angle)], axis=1)


def frame_of(direction):
    """Two unit vectors across a unit vector, and across each other."""
    least = np.eye(3)[np.abs(direction).argmin()]
    first = np.cross(least, direction)
    first /= np.linalg.norm(first)
    return first, np.cross(direction, first)


class Light:
    """`key` points from the scene to the key light. `casters` are surfaces that throw shadows; they
    are looked at anew by aim()."""

    def __init__(self, key, casters):
        around = spiral(AROUND)
        key = np.asarray(key) / np.linalg.norm(key)
        first, second = frame_of(key)
        k = np.arange(KEY) + 0.5
        radius, angle = KEY_WIDTH * np.sqrt(k / KEY), np.pi * (1 + 5**0.5) * k
        bundle = key + np.outer(radius * np.cos(angle), first) + np.outer(radius * np.sin(angle), second)
        bundle /= np.linalg.norm(bundle, axis=1)[:, None]
        self.directions = np.concatenate([around, bundle])
        sky = GROUND + (1 - GROUND) * 0.5 * (1 + around[:, 1])
        # A surface that faces up sees the light (mean cosine 1/4) of all the sphere.
        self.strength = np.concatenate([
            sky * (1 - KEY_SHARE) / (0.25 * AROUND), np.full(KEY, KEY_SHARE / KEY)])
        self.renderer = vtkRenderer()
        for surface in casters:
            mapper = vtkPolyDataMapper()
            mapper.SetInputData(surface)
            mapper.ScalarVisibilityOff()
            actor = vtkActor()
            actor.SetMapper(mapper)
            actor.GetProperty().LightingOff()
            self.renderer.AddActor(actor)
        self.window = vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(MAP, MAP)
        self.window.AddRenderer(self.renderer)

    def aim(self, points):
        """Draws the maps; `points` of the casters."""
        low, high = points.min(axis=0), points.max(axis=0)
        self.centre = 0.5 * (low + high)
        self.radius = max(1.02 * np.linalg.norm(points - self.centre, axis=1).max(), 1e-12)
        camera = self.renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetParallelScale(self.radius)
        camera.SetFocalPoint(self.centre)
        self.maps = []
        for direction in self.directions:
            camera.SetPosition(self.centre + 2 * self.radius * direction)
            camera.SetViewUp(frame_of(direction)[1])
            camera.SetClippingRange(self.radius, 3 * self.radius)
            self.window.Render()
            depths = vtkFloatArray()
            self.window.GetZbufferData(0, 0, MAP - 1, MAP - 1, depths)
            depths = np.array(vtk_to_numpy(depths)).reshape(MAP, MAP)
            depths[depths >= 1] = np.inf
            self.maps.append(depths)

    def share(self, points, normals):
        """Of the light without shadows what arrives at each point, from 0 to 1."""
        around, key, both = self.arriving(points, normals)
        return (around + key) / both

    def arriving(self, points, normals):
        """What arrives at each point from all around and of the key light, and the sum of both if
        nothing were in the way."""
        pixel = 2 * self.radius / MAP
        # Away from the surface itself, whose pixels are as wide as they are.
        from_centre = points + 1.5 * pixel * normals - self.centre
        arrives, both = np.zeros((2, len(points))), np.full(len(points), 1e-12)
        for number, (direction, strength, depths) in enumerate(
                zip(self.directions, self.strength, self.maps)):
            facing = strength * np.maximum(normals @ direction, 0)
            both += facing
            right, up = frame_of(direction)
            depth = 0.5 - from_centre @ direction / (2 * self.radius) - 0.75 / MAP
            # Of the four pixels around: the share of those that let the light pass.
            x = (from_centre @ right / self.radius + 1) * 0.5 * MAP - 0.5
            y = (from_centre @ up / self.radius + 1) * 0.5 * MAP - 0.5
            column, row = np.floor(x).astype(int), np.floor(y).astype(int)
            inside = (column >= 0) & (row >= 0) & (column < MAP - 1) & (row < MAP - 1) & (facing > 0)
            i, j = row[inside], column[inside]
            s, t, d = x[inside] - j, y[inside] - i, depth[inside]
            lit = np.ones(len(points))
            lit[inside] = ((1 - t) * ((1 - s) * (depths[i, j] >= d) + s * (depths[i, j + 1] >= d)) +
                           t * ((1 - s) * (depths[i + 1, j] >= d) + s * (depths[i + 1, j + 1] >= d)))
            arrives[int(number >= AROUND)] += facing * lit
        return *arrives, both
