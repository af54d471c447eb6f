"""Draws a result of `taut run`: PNGs of chosen frames and an animation, off screen.

The camera stands still and sees every frame that is drawn. Surfaces are coloured by object, or by
speed or displacement on one scale for all frames.
"""

import argparse
import os
import sys

# Draw off screen even where there is a screen; the choice of window must stand before VTK is loaded.
os.environ.pop("DISPLAY", None)
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
import numpy as np
import pyvista as pv
from PIL import Image
from vtkmodules.vtkIOHDF import vtkHDFReader

# Okabe and Ito's colours, lightened a little: told apart by all kinds of colour vision.
COLOURS = ["#4a9bd1", "#e8894a", "#3fb58f", "#e2b93b", "#d98cb8", "#7fc4ec", "#8a8a8a"]
VIEW_ANGLE = 25.0  # degrees, from the lower to the upper edge of the picture
MARGIN = 0.92  # the part of the picture that the body may fill
TITLES = {"speed": "speed, m/s", "displacement": "displacement, m"}


class Frames:
    """The surface of the result, its points frame by frame."""

    def __init__(self, path):
        # VTK's own reader: what pyvista offers of it differs from release to release.
        self.reader = vtkHDFReader()
        self.reader.SetFileName(path)
        self.reader.UpdateInformation()
        self.count = self.reader.GetNumberOfSteps()
        grid = self.read(0)
        grid["vertex"] = np.arange(grid.n_points)
        self.rest = np.array(grid.points)
        surface = grid.extract_surface(algorithm="dataset_surface").clean(tolerance=0)
        # Vertices on sharp edges of the first frame are doubled, once, so that edges stay crisp.
        self.surface = surface.compute_normals(cell_normals=False, split_vertices=True,
                                               feature_angle=40)
        self.vertex = np.array(self.surface["vertex"])
        self.velocity = np.zeros_like(self.rest)

    def __len__(self):
        return self.count

    def read(self, frame):
        self.reader.SetStep(frame)
        self.reader.Update()
        return pv.wrap(self.reader.GetOutput()).copy()

    def load(self, frame):
        """Moves the surface to the frame and returns it."""
        grid = self.read(frame)
        self.surface.points = np.array(grid.points)[self.vertex]
        if "velocity" in grid.point_data:
            self.velocity = np.array(grid.point_data["velocity"])
        return self.surface

    def field(self, name):
        vectors = self.velocity[self.vertex] if name == "speed" else (
            self.surface.points - self.rest[self.vertex])
        return np.linalg.norm(vectors, axis=1)


class Picture:
    """One plotter for all frames; only points and colours change between them."""

    def __init__(self, frames, drawn, options):
        self.frames, self.colour = frames, options.colour
        self.font = max(8, options.size[1] // 36)  # pixels
        # The camera sees all frames.
        cloud, top = [], 0.0
        for done, frame in enumerate(drawn):
            say(f"looking at frame {frame}", done, len(drawn))
            surface = frames.load(frame)
            cloud.append(extremes(surface.points))
            if self.colour != "object":
                top = max(top, frames.field(self.colour).max())

        self.plotter = pv.Plotter(off_screen=True, window_size=options.size, lighting="none")
        self.plotter.set_background("#ffffff", top="#e9eef3")
        self.add_surface(top)
        self.place_camera(np.concatenate(cloud), options)
        self.plotter.enable_anti_aliasing("ssaa")

    def add_surface(self, top):
        surface = self.frames.surface
        look = {"smooth_shading": True, "split_sharp_edges": False, "ambient": 0.18, "diffuse": 0.85,
                "specular": 0.18, "specular_power": 18, "copy_mesh": False}
        if self.colour == "object":
            objects = surface["object"].astype(int)
            surface["colour"] = np.array(
                [pv.Color(COLOURS[i % len(COLOURS)]).int_rgb for i in range(objects.max() + 1)],
                dtype=np.uint8)[objects]
            self.plotter.add_mesh(surface, scalars="colour", rgb=True, **look)
        else:
            surface[self.colour] = np.zeros(surface.n_points)
            self.plotter.add_mesh(surface, scalars=self.colour, cmap="viridis",
                                  clim=[0, top or 1], **look, scalar_bar_args={
                                      "title": TITLES[self.colour], "vertical": True,
                                      "color": "#333333", "n_labels": 3,
                                      "title_font_size": self.font, "label_font_size": self.font, "width": 0.05,
                                      "height": 0.4, "position_x": 0.9, "position_y": 0.3})

    def place_camera(self, points, options):
        """As near as all points fit. A key light over the left shoulder of the camera, a weak one
        from the right."""
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
        camera.clipping_range = (max(0.01 * radius, distance - 2 * radius), distance + 2 * radius)
        for side, up, strength in ((-0.8, 1.2, 0.95), (1.2, 0.3, 0.35)):
            position = centre + 10 * radius * (towards + side * aside + up * above)
            self.plotter.add_light(pv.Light(position=position, focal_point=centre,
                                            intensity=strength))

    def show(self, frame):
        """The picture of a frame, [height][width][rgb]."""
        surface = self.frames.load(frame)
        if self.colour != "object":
            surface[self.colour][:] = self.frames.field(self.colour)
        # Normals follow the moved points; the vertices on edges are doubled already.
        surface["Normals"] = np.array(surface.compute_normals(
            cell_normals=False, split_vertices=False, consistent_normals=False)["Normals"])
        surface.Modified()
        self.plotter.render()
        return self.plotter.screenshot(return_img=True)


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
    parser.add_argument("--colour", choices=["object", "speed", "displacement"], required=True)
    parser.add_argument("--size", type=int, nargs=2, required=True)
    parser.add_argument("--view", type=float, nargs=3, required=True)
    parser.add_argument("--animation")
    parser.add_argument("--fps", type=float, default=30)
    parser.add_argument("--most-frames", type=int, default=150)
    options = parser.parse_args()

    frames = Frames(options.result)
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
