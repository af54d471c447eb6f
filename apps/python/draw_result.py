"""Draws a result of `taut run`: PNGs of chosen frames and an animation, off screen. Bodies are
surfaces, or material points that are drawn as balls.

The camera stands still and sees the bodies of every frame that is drawn. They are coloured by object,
or by speed or displacement on one scale for all frames. Obstacles are grey and let the bodies behind
them be seen; planes are the ground and the walls that bodies throw shadows on, and those between the
camera and the bodies are left out.
"""

import argparse
import os
import sys

# Draw off screen even where there is a screen; the choice of window must stand before VTK is loaded.
os.environ.pop("DISPLAY", None)
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
import matplotlib
import numpy as np
import pyvista as pv
from PIL import Image
from vtkmodules.vtkCommonCore import vtkIdList
from vtkmodules.vtkCommonDataModel import vtkStaticPointLocator
from vtkmodules.vtkIOHDF import vtkHDFReader

from draw_light import Light, frame_of

# Okabe and Ito's colours, lightened a little: told apart by all kinds of colour vision. Grey is for
# obstacles.
COLOURS = ["#4a9bd1", "#f0935a", "#45b892", "#ecc344", "#dd92bd", "#8ccdf0", "#7a6fc0"]
GROUND, WALL, OBSTACLE = "#e9edf1", "#e4e8ed", "#8d98a5"
BODY, TOUCHED, DRAWN_ONLY = 0, 1, 2  # kinds of objects, as in core/io/vtkhdf.hpp
VIEW_ANGLE = 25.0  # degrees, from the lower to the upper edge of the picture
MARGIN = 0.92  # the part of the picture that the bodies may fill
AROUND_BODIES = 0.15  # what is framed of an obstacle: as far from the bodies, in their diagonals
CELLS = 200  # across the picture of a plane
PIECE, PIECES = 0.04, 60000  # of triangles: their length, in half diagonals of the bodies; how many
BALL = 1.5  # diameter of a material point, in distances to the next: no gaps between them
TITLES = {"speed": "speed, m/s", "displacement": "displacement, m"}


def rgb(colour):
    return np.array(pv.Color(colour).int_rgb, dtype=float)


class Surface:
    """The surface of some cells of the grid. It follows the points of the grid; its vertices on edges
    that are sharp at first are doubled, so that they stay crisp."""

    def __init__(self, grid, cells):
        part = grid.extract_cells(cells).extract_surface(algorithm="dataset_surface")
        part = part.clean(point_merging=False).triangulate()
        part = part.compute_normals(cell_normals=False, split_vertices=True, feature_angle=40,
                                    consistent_normals=False)
        self.vertex = np.array(part["vertex"])
        self.object = np.array(part["object"]).astype(int)
        self.mesh = pv.PolyData(np.array(part.points), faces=np.array(part.faces))
        self.fine = None

    def move(self, points):
        self.mesh.points = points[self.vertex]
        self.mesh["Normals"] = np.array(self.mesh.compute_normals(
            cell_normals=False, split_vertices=False, consistent_normals=False)["Normals"])
        self.mesh.point_data.active_normals_name = "Normals"
        if self.fine is not None:
            self.follow()

    def refine(self, length):
        """Cuts triangles into pieces no longer than that, as far as PIECES allow: light is found at
        the vertices. What is drawn from here on is `fine`, whose vertices are means of the mesh's."""
        corners = self.mesh.regular_faces
        sides = self.mesh.points[corners] - self.mesh.points[np.roll(corners, 1, axis=1)]
        longest = np.linalg.norm(sides, axis=2).max(axis=1)
        cuts = np.ones(len(corners), dtype=int)
        while len(corners) < PIECES:
            cuts = np.clip(np.ceil(longest / length), 1, 40).astype(int)
            if (cuts**2).sum() <= PIECES:
                break
            length *= 1.2
        self.corners, self.weights, self.object_of_vertex, faces = [], [], [], []
        count = 0
        for n in np.unique(cuts):
            chosen = np.flatnonzero(cuts == n)
            i, j = np.array([(i, j) for i in range(n + 1) for j in range(n + 1 - i)]).T
            number = np.zeros((n + 2, n + 2), dtype=int)
            number[i, j] = np.arange(len(i))
            inner = i + j < n
            up = np.stack([number[i, j], number[i + 1, j], number[i, j + 1]], axis=1)[inner]
            i2, j2 = i[i + j < n - 1], j[i + j < n - 1]
            down = np.stack([number[i2 + 1, j2], number[i2 + 1, j2 + 1], number[i2, j2 + 1]], axis=1)
            cells = np.concatenate([up, down])
            first = count + len(i) * np.arange(len(chosen))
            faces.append((first[:, None, None] + cells).reshape(-1, 3))
            self.corners.append(np.repeat(corners[chosen], len(i), axis=0))
            self.weights.append(np.tile(np.stack([n - i - j, i, j], axis=1) / n, (len(chosen), 1)))
            self.object_of_vertex.append(np.repeat(self.object[chosen], len(i)))
            count += len(i) * len(chosen)
        self.corners, self.weights, self.object_of_vertex = (
            np.concatenate(a) for a in (self.corners, self.weights, self.object_of_vertex))
        self.fine = pv.PolyData.from_regular_faces(np.zeros((count, 3)), np.concatenate(faces))
        self.fine["colour"] = np.zeros((count, 3), dtype=np.uint8)
        self.follow()

    def follow(self):
        self.fine.points = self.mean(self.mesh.points)
        normals = self.mean(self.mesh["Normals"])
        normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
        self.fine["Normals"] = normals
        self.fine.point_data.active_normals_name = "Normals"

    def mean(self, values):
        """At the vertices of `fine` from those of the mesh."""
        weights = self.weights if values.ndim == 1 else self.weights[:, :, None]
        return (weights * values[self.corners]).sum(axis=1)

    def paint(self, light, base, least):
        """Colours `fine` as it is in the light that arrives, but at least so much of it."""
        share = light.share(self.fine.points, self.fine["Normals"])
        self.fine["colour"][:] = ((least + (1 - least) * share)[:, None] * base).round()
        self.fine.Modified()


class Points:
    """Material points, drawn as balls that nearly touch. Has what a Surface has."""

    def __init__(self, grid, cells):
        self.vertex = np.flatnonzero(cells)  # the cells of particles are their points, in order
        self.object_of_vertex = np.array(grid["object"])[cells].astype(int)
        self.mesh = self.fine = pv.PolyData(np.array(grid.points)[self.vertex])
        self.fine["colour"] = np.zeros((len(self.vertex), 3), dtype=np.uint8)
        self.spacing = self.typical_distance()

    def typical_distance(self):
        """To the nearest of the others: the median of some."""
        locator = vtkStaticPointLocator()
        locator.SetDataSet(self.mesh)
        locator.BuildLocator()
        found, distances = vtkIdList(), []
        for number in range(0, self.mesh.n_points, max(1, self.mesh.n_points // 500)):
            point = self.mesh.points[number]
            locator.FindClosestNPoints(2, point, found)
            others = [found.GetId(k) for k in range(found.GetNumberOfIds())]
            distances += [np.linalg.norm(self.mesh.points[k] - point) for k in others if k != number]
        return float(np.median(distances)) if distances else 1.0

    def move(self, points):
        """Those in `vertex`, which may be more than before."""
        if self.mesh.n_points == len(self.vertex):
            self.mesh.points = points[self.vertex]
            return
        fresh = pv.PolyData()
        if len(self.vertex):
            fresh = pv.PolyData(points[self.vertex])
            fresh["colour"] = np.zeros((len(self.vertex), 3), dtype=np.uint8)
            fresh.set_active_scalars("colour")
        self.mesh.ShallowCopy(fresh)

    def refine(self, length):
        """They are as fine as they are."""

    def mean(self, values):
        return values

    def paint(self, light, base, least):
        """Balls have a light and a dark side of their own; what is deep between others is not seen."""
        if self.mesh.n_points:
            self.fine["colour"][:] = base[:self.mesh.n_points].round()
        self.fine.Modified()


class Plane:
    """A half space. Three points of its patch say where it is; normals point to the bodies."""

    def __init__(self, triangle):
        self.triangle = triangle

    @staticmethod
    def is_one(points):
        sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        return sizes[-1] < 1e-6 * sizes[0]

    def move(self, points):
        a, b, c = points[self.triangle]
        self.point = a
        normal = np.cross(b - a, c - a)
        self.normal = normal / np.linalg.norm(normal)

    def patch(self, around, radius):
        """The part of the plane under a ball, twice as wide: points, and 0 to 1 from its edge on."""
        foot = around - (around - self.point) @ self.normal * self.normal
        first, second = frame_of(self.normal)
        steps = np.linspace(-1, 1, CELLS + 1)
        a, b = (axis.ravel() for axis in np.meshgrid(steps, steps, indexing="ij"))
        fade = np.clip((1 - np.hypot(a, b)) / 0.6, 0, 1)
        points = foot + 2 * radius * (np.outer(a, first) + np.outer(b, second))
        return points, fade * fade * (3 - 2 * fade)

    @staticmethod
    def cells():
        i, j = (index.ravel() for index in np.mgrid[:CELLS, :CELLS])
        corner = i * (CELLS + 1) + j
        above = corner + CELLS + 1
        return pv.PolyData.from_regular_faces(
            np.zeros(((CELLS + 1)**2, 3)),
            np.stack([corner, above, above + 1, corner + 1], axis=1)).faces


class Frames:
    """What a result shows, frame by frame: bodies, obstacles that are surfaces, rooms (what keeps
    bodies inside) and planes."""

    def __init__(self, path, kinds):
        # VTK's own reader: what pyvista offers of it differs from release to release.
        self.reader = vtkHDFReader()
        self.reader.SetFileName(path)
        self.reader.UpdateInformation()
        self.count = self.reader.GetNumberOfSteps()
        grid = self.read(0)
        if self.read(self.count - 1).n_points != grid.n_points:
            grid = self.read(self.count - 1)  # sources have let out more: there are all that come
        grid["vertex"] = np.arange(grid.n_points)
        self.rest = np.array(grid.points)
        objects = np.array(grid["object"]).astype(int)
        kind = np.array(kinds)[objects]
        self.of_points = bool((grid.celltypes[kind == BODY] == pv.CellType.VERTEX).all())
        self.bodies = (Points if self.of_points else Surface)(grid, kind == BODY)
        self.obstacles = Surface(grid, kind == TOUCHED) if (kind == TOUCHED).any() else None
        self.planes, room = [], np.zeros(len(objects), dtype=bool)
        for number in np.unique(objects[kind == DRAWN_ONLY]):
            cells = objects == number
            first = grid.get_cell(int(np.flatnonzero(cells)[0]))
            if Plane.is_one(np.array(grid.extract_cells(cells).points)):
                self.planes.append(Plane(np.array(first.point_ids)))
            else:
                room |= cells
        self.room = Surface(grid, room) if room.any() else None
        self.velocity = np.zeros_like(self.rest)
        self.all, self.seen = self.bodies.vertex, 0

    def __len__(self):
        return self.count

    def read(self, frame):
        self.reader.SetStep(frame)
        self.reader.Update()
        return pv.wrap(self.reader.GetOutput()).copy()

    def load(self, frame):
        """Moves everything to the frame."""
        grid = self.read(frame)
        missing = len(self.rest) - grid.n_points  # particles that are yet to come out of sources
        there = len(self.all) - missing if missing else None
        if self.of_points:
            self.bodies.vertex = self.all[:there]

        def spread(values):
            """Leaves room for what is not there yet: the particles are the first of the points."""
            gap = np.zeros((missing, 3))
            return np.concatenate([values[:there], gap, values[there:]]) if missing else values

        points = spread(np.array(grid.points))
        if there is not None and there > self.seen:  # displaced from where they were seen first
            self.rest[self.seen:there] = points[self.seen:there]
            self.seen = there
        for part in (self.bodies, self.obstacles, self.room, *self.planes):
            if part is not None:
                part.move(points)
        if "velocity" in grid.point_data:
            self.velocity = spread(np.array(grid.point_data["velocity"]))

    def field(self, name):
        vertex = self.bodies.vertex
        vectors = self.velocity[vertex] if name == "speed" else (
            self.bodies.mesh.points - self.rest[vertex])
        return np.linalg.norm(vectors, axis=1)


class Picture:
    """One plotter for all frames; only points and colours change between them."""

    def __init__(self, frames, drawn, options):
        self.frames, self.colour = frames, options.colour
        self.size = options.size
        # Drawn so much larger: four samples per pixel are too few for edges of strong contrast.
        self.scale = 2 if max(self.size) <= 4096 else 1
        bodies, framed, self.top = [], [], 0.0
        for done, frame in enumerate(drawn):
            say(f"looking at frame {frame}", done, len(drawn))
            frames.load(frame)
            if frames.bodies.mesh.n_points:  # else all is yet to come out of sources
                bodies.append(extremes(frames.bodies.mesh.points))
            if frames.obstacles and not (framed and np.array_equal(framed[-1],
                                                                   frames.obstacles.mesh.points)):
                framed.append(np.array(frames.obstacles.mesh.points))
            if self.colour != "object":
                self.top = max(self.top, frames.field(self.colour).max(initial=0))
        bodies = np.concatenate(bodies)
        low, high = bodies.min(axis=0), bodies.max(axis=0)
        self.middle, self.reach = 0.5 * (low + high), 0.5 * np.linalg.norm(high - low) or 1
        room = 2 * AROUND_BODIES * self.reach
        near = [p[((p > low - room) & (p < high + room)).all(axis=1)] for p in framed]
        self.plotter = pv.Plotter(off_screen=True, lighting="none",
                                  window_size=[self.scale * n for n in self.size])
        self.plotter.set_background("#f6f8fa", top="#dfe6ee")
        key = self.place_camera(np.concatenate([bodies, *map(extremes, filter(len, near))]), options)
        self.light = Light(key, [frames.bodies.mesh])
        for surface in (frames.bodies, frames.obstacles, frames.room):
            if surface:
                surface.refine(PIECE * self.reach)
        self.add_bodies()
        self.add_planes()
        self.add_obstacles()
        self.plotter.enable_anti_aliasing("msaa", multi_samples=4)

    def add_bodies(self):
        bodies = self.frames.bodies
        if self.colour == "object":
            self.base = np.array([rgb(c) for c in COLOURS])[
                bodies.object_of_vertex % len(COLOURS)]
        else:
            # The scale beside the picture is that of two points that are not seen.
            scale = pv.PolyData(np.tile(self.middle, (2, 1)))
            scale[self.colour] = np.array([0, self.top or 1])
            font = self.scale * max(8, self.size[1] // 36)  # pixels
            self.plotter.add_mesh(scale, scalars=self.colour, cmap="viridis", opacity=0,
                                  scalar_bar_args={
                                      "title": TITLES[self.colour], "vertical": True,
                                      "color": "#333333", "n_labels": 3, "title_font_size": font,
                                      "label_font_size": font, "width": 0.05, "height": 0.4,
                                      "position_x": 0.9, "position_y": 0.3})
        if self.frames.of_points:
            # As large as they are in the middle of the picture.
            camera = self.plotter.camera
            distance = np.linalg.norm(np.array(camera.position) - np.array(camera.focal_point))
            pixel = 2 * distance * np.tan(np.radians(VIEW_ANGLE / 2)) / (self.scale * self.size[1])
            self.plotter.add_mesh(bodies.fine, scalars="colour", rgb=True, copy_mesh=False,
                                  style="points", render_points_as_spheres=True,
                                  point_size=max(2.0, BALL * bodies.spacing / pixel), ambient=0.45,
                                  diffuse=0.7, specular=0.1, specular_power=24)
            return
        self.plotter.add_mesh(bodies.fine, scalars="colour", rgb=True, copy_mesh=False,
                              smooth_shading=True, split_sharp_edges=False, ambient=0.56,
                              diffuse=0.62, specular=0.12, specular_power=24)

    def add_obstacles(self):
        frames = self.frames
        if frames.obstacles:
            self.plotter.add_mesh(frames.obstacles.fine, scalars="colour", rgb=True, opacity=0.35,
                                  ambient=0.45, diffuse=0.6, specular=0.25, specular_power=30,
                                  smooth_shading=True, split_sharp_edges=False, copy_mesh=False)
        if frames.room:
            self.plotter.add_mesh(frames.room.fine, scalars="colour", rgb=True, culling="back",
                                  ambient=0.75, diffuse=0.3, smooth_shading=True,
                                  split_sharp_edges=False, copy_mesh=False)

    def add_planes(self):
        """Before what lets them be seen through itself: the translucent is drawn in this order."""
        for plane in self.frames.planes:
            mesh = pv.PolyData(np.tile(self.middle, (3, 1)), faces=[3, 0, 1, 2])
            mesh["colour"] = np.zeros((3, 4), dtype=np.uint8)
            plane.actor = self.plotter.add_mesh(mesh, scalars="colour", rgb=True, lighting=False)

    def draw_planes(self):
        """Those that are seen from their bodies' side, each up to the others."""
        eye = np.array(self.plotter.camera.position)
        planes = self.frames.planes
        for plane in planes:
            plane.actor.visibility = bool((eye - plane.point) @ plane.normal > 0)
            if not plane.actor.visibility:
                continue
            points, alpha = plane.patch(self.middle, 1.5 * self.reach)
            around, key, both = self.light.arriving(points, np.tile(plane.normal, (len(points), 1)))
            shade = (blurred(around, CELLS // 20) + blurred(key, 1)) / both
            mesh = pv.PolyData(points, faces=Plane.cells())
            colour = np.outer(0.3 + 0.7 * shade, rgb(GROUND if plane.normal[1] > 0.5 else WALL))
            mesh["colour"] = np.column_stack([colour, 255 * alpha])
            for other in planes:
                if other is not plane and mesh.n_points:
                    mesh = mesh.clip(normal=other.normal, origin=other.point, invert=False)
            plane.actor.visibility = mesh.n_points > 0
            if mesh.n_points:
                mesh["colour"] = mesh["colour"].round().astype(np.uint8)
                mesh.set_active_scalars("colour")
                plane.actor.mapper.SetInputData(mesh)

    def place_camera(self, points, options):
        """As near as all points fit. Places the lights and returns the direction of the first: over
        the left shoulder of the camera; a weaker one is at its right, a third by the camera."""
        towards = np.array(options.view) / np.linalg.norm(options.view)
        aside = np.cross([0, 1, 0] if abs(towards[1]) < 0.999 else [0, 0, -1], towards)
        aside /= np.linalg.norm(aside)
        above = np.cross(towards, aside)
        width, height = options.size
        tangent = np.tan(np.radians(VIEW_ANGLE / 2)) * MARGIN
        # Seen from distance d of the centre, a point at (a, u, t) along aside, above and towards is
        # inside if |u| <= tangent (d - t) and |a| <= tangent width/height (d - t).
        centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        for _ in range(20):  # the centre of the picture is not that of the box: perspective
            a, u, t = ((points - centre) @ axis for axis in (aside, above, towards))
            distance = max((np.abs(u) / tangent + t).max(),
                           (np.abs(a) / (tangent * width / height) + t).max(), 1e-9)
            x, y = a / (distance - t), u / (distance - t)
            shift = 0.5 * distance * np.array([x.min() + x.max(), y.min() + y.max()])
            centre = centre + shift[0] * aside + shift[1] * above
        radius = np.linalg.norm(points - centre, axis=1).max()
        camera = self.plotter.camera
        camera.view_angle = VIEW_ANGLE
        camera.focal_point = centre
        camera.position = centre + towards * distance
        camera.up = above
        camera.clipping_range = (max(0.01 * radius, distance - 6 * radius), distance + 6 * radius)
        directions = [towards + side * aside + up * above
                      for side, up in ((-0.7, 1.5), (1.2, 0.4), (0.1, 0.1))]
        for direction, strength in zip(directions, (0.72, 0.22, 0.22)):
            self.plotter.add_light(pv.Light(position=centre + 10 * radius * direction,
                                            focal_point=centre, intensity=strength))
        return directions[0]

    def show(self, frame):
        """The picture of a frame, [height][width][rgb]."""
        frames = self.frames
        frames.load(frame)
        casters = frames.bodies.mesh
        self.light.aim(casters.points if casters.n_points else self.middle[None])
        if self.colour != "object":
            values = frames.bodies.mean(frames.field(self.colour)) / (self.top or 1)
            self.base = 255 * matplotlib.colormaps["viridis"](values)[:, :3]
        frames.bodies.paint(self.light, self.base, 0.3)
        if frames.obstacles:
            frames.obstacles.paint(self.light, rgb(OBSTACLE), 0.1)
        if frames.room:
            frames.room.paint(self.light, rgb(WALL), 0.4)
        self.draw_planes()
        self.plotter.render()
        image = Image.fromarray(self.plotter.screenshot(return_img=True))
        return np.asarray(image.resize(self.size, Image.Resampling.BOX))


def blurred(values, width):
    """Values on the grid of a plane's patch, without the edges of the shadows of single directions:
    their means over `width` cells to each side."""
    grid = values.reshape(CELLS + 1, CELLS + 1)
    for _ in range(2):  # twice even is a tent
        for axis in (0, 1):
            ends = [(width, width) if a == axis else (0, 0) for a in (0, 1)]
            sums = np.cumsum(np.pad(grid, ends, mode="edge"), axis=axis)
            sums = np.insert(sums, 0, 0, axis=axis)
            count = 2 * width + 1
            here, there = [slice(None)] * 2, [slice(None)] * 2
            here[axis], there[axis] = slice(count, None), slice(None, -count)
            grid = (sums[tuple(here)] - sums[tuple(there)]) / count
    return grid.ravel()


def extremes(points):
    """The points that are farthest in 26 directions: all a camera needs to know of a body."""
    steps = (-1, 0, 1)
    directions = np.array([(x, y, z) for x in steps for y in steps for z in steps if x or y or z])
    return points[np.unique((points @ directions.T).argmax(axis=0))]


def say(what, done, total):
    """A line on a terminal that is overwritten by the next one; nothing elsewhere."""
    if sys.stderr.isatty():
        end = "" if done < total else "\n"
        print(f"\r{what}  {100 * done // total}%\x1b[K", end=end, file=sys.stderr, flush=True)


def animate(path, picture, chosen, fps):
    def pictures():
        for done, frame in enumerate(chosen):
            say(f"animating: frame {frame}", done, len(chosen))
            yield picture.show(frame)
        say("animating", 1, 1)

    if path.endswith(".gif"):
        images = [Image.fromarray(image) for image in pictures()]
        # One palette for all frames, or colours would flicker; made from some of them one above the
        # other, that none misses its colours.
        some = images[::max(1, len(images) // 6)]
        palette = Image.fromarray(np.concatenate([np.asarray(image) for image in some])).quantize(255)
        images = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
        images[0].save(path, save_all=True, append_images=images[1:], duration=round(1000 / fps),
                       loop=0, optimize=False)
    else:
        import imageio.v2 as imageio
        with imageio.get_writer(path, fps=fps, codec="libx264", quality=8) as writer:
            for image in pictures():
                writer.append_data(image)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--result", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--frames", type=int, nargs="+", required=True)
    parser.add_argument("--kinds", type=int, nargs="+", required=True, help="of the objects")
    parser.add_argument("--colour", choices=["object", "speed", "displacement"], required=True)
    parser.add_argument("--size", type=int, nargs=2, required=True)
    parser.add_argument("--view", type=float, nargs=3, required=True)
    parser.add_argument("--animation")
    parser.add_argument("--fps", type=float, default=30)
    parser.add_argument("--most-frames", type=int, default=150)
    options = parser.parse_args()

    frames = Frames(options.result, options.kinds)
    stride = -(-len(frames) // options.most_frames)
    moving = list(range(0, len(frames), stride)) if options.animation else []
    picture = Picture(frames, sorted({*options.frames, *moving}), options)
    for frame in options.frames:
        Image.fromarray(picture.show(frame)).save(
            os.path.join(options.out, f"frame_{frame:05}.png"))
    if moving:
        animate(options.animation, picture, moving, options.fps)


if __name__ == "__main__":
    sys.exit(main())
