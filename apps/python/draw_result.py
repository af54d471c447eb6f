"""Draws a result of `taut run`: PNGs of chosen frames and an animation, off screen.

The camera stands still and sees every frame that is drawn. Surfaces are coloured by object, or by
speed or displacement on one scale for all frames.
"""

import argparse
import os
import sys

os.environ.pop("DISPLAY", None)  # draw off screen even where there is one
import numpy as np
import pyvista as pv
from PIL import Image

# Okabe and Ito's colours, lightened a little: told apart by all kinds of colour vision.
COLOURS = ["#4a9bd1", "#e8894a", "#3fb58f", "#e2b93b", "#d98cb8", "#7fc4ec", "#8a8a8a"]
TITLES = {"speed": "speed, m/s", "displacement": "displacement, m"}


class Frames:
    """The surface of the result, its points frame by frame."""

    def __init__(self, path):
        self.reader = pv.get_reader(path)
        self.times = list(self.reader.time_values)
        self.reader.set_active_time_value(self.times[0])
        grid = self.reader.read()
        grid["vertex"] = np.arange(grid.n_points)
        self.rest = np.array(grid.points)
        self.surface = grid.extract_surface(algorithm="dataset_surface").clean(tolerance=0)
        self.vertex = self.surface["vertex"]
        self.velocity = np.zeros_like(self.rest)

    def __len__(self):
        return len(self.times)

    def load(self, frame):
        """Moves the surface to the frame and returns it."""
        self.reader.set_active_time_value(self.times[frame])
        grid = self.reader.read()
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
        bounds, top = [], 0.0
        for frame in drawn:
            surface = frames.load(frame)
            bounds.append(surface.bounds)
            if self.colour != "object":
                top = max(top, frames.field(self.colour).max())
        bounds = np.array(bounds)
        low, high = bounds[:, 0::2].min(axis=0), bounds[:, 1::2].max(axis=0)

        self.plotter = pv.Plotter(off_screen=True, window_size=options.size, lighting="none")
        self.plotter.set_background("#ffffff", top="#e9eef3")
        self.add_surface(top)
        self.place_camera(0.5 * (low + high), 0.5 * np.linalg.norm(high - low), options.view)
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
                                      "color": "#333333", "n_labels": 3, "width": 0.05,
                                      "height": 0.4, "position_x": 0.9, "position_y": 0.3})

    def place_camera(self, centre, radius, view):
        """A key light over the left shoulder of the camera, a weak one from the right."""
        towards = np.array(view) / np.linalg.norm(view)
        right = np.cross([0, 1, 0], towards)
        right /= np.linalg.norm(right)
        camera = self.plotter.camera
        camera.view_angle = 25.0
        camera.focal_point = centre
        camera.position = centre + towards * 1.08 * radius / np.sin(np.radians(12.5))
        camera.up = (0, 1, 0)
        camera.clipping_range = (0.01 * radius, 20 * radius)
        for side, height, strength in ((-0.8, 1.2, 0.95), (1.2, 0.3, 0.35)):
            position = centre + 10 * radius * (towards + side * right + height * np.array([0, 1, 0]))
            self.plotter.add_light(pv.Light(position=position, focal_point=centre,
                                            intensity=strength))

    def show(self, frame):
        """The picture of a frame, [height][width][rgb]."""
        surface = self.frames.load(frame)
        if self.colour != "object":
            surface[self.colour][:] = self.frames.field(self.colour)
        surface.compute_normals(cell_normals=False, split_vertices=False, inplace=True)
        surface.Modified()
        return self.plotter.screenshot(return_img=True)


def animate(path, picture, chosen, fps):
    if path.endswith(".gif"):
        # One palette for all frames, or colours would flicker.
        images = [Image.fromarray(picture.show(frame)) for frame in chosen]
        palette = images[len(images) // 2].quantize(255)
        images = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
        images[0].save(path, save_all=True, append_images=images[1:], duration=round(1000 / fps),
                       loop=0, optimize=False)
    else:
        import imageio.v2 as imageio
        with imageio.get_writer(path, fps=fps, codec="libx264", quality=8) as writer:
            for frame in chosen:
                writer.append_data(picture.show(frame))


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
