"""Draws the data of `taut chart`: draw_chart.py DATA.csv OUT writes OUT.svg and OUT.png.

A comparison has a row of panels per frame and measure, over iterations, over seconds, which are
frames per second above, and over linear iterations where these were counted; a sweep has iterations
and seconds over the swept value. Every curve is labelled at its end. A method that did not come
below the target is a failure: it ends in a cross with the reason. More curves than can be told apart
are bars instead, a group per scene. The stability of policies is a bar each, up to the last clean
step, with what came then.

Where there are residuals, residual.svg and residual.png beside OUT show the same by these, as the
literature has it. frames.csv, fields.csv and patterns.csv beside DATA.csv have pictures of their own.
"""

import csv
import math
import os
import re
import sys

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, ScalarFormatter

# Okabe and Ito's colours, told apart by all kinds of colour vision; then again, dashed.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]
DASHES = ["solid", (0, (5, 1.5)), (0, (1, 1.2)), (0, (5, 1.5, 1, 1.5))]
WORDS = ("scene", "method", "policy", "hierarchy", "ended", "why")
MOST_CURVES = 14  # in a panel
INK, PALE = "#333333", "#999999"
HALO = [withStroke(linewidth=2.5, foreground="white")]

plt.rcParams.update({
    "font.family": "DejaVu Sans", "font.size": 9, "axes.edgecolor": PALE, "axes.linewidth": 0.8,
    "axes.spines.top": False, "axes.spines.right": False, "axes.labelcolor": INK,
    "xtick.color": INK, "ytick.color": INK, "text.color": INK, "svg.fonttype": "none",
    "axes.grid": True, "grid.color": "#e6e6e6", "grid.linewidth": 0.6,
    "axes.axisbelow": True,
})


def read(path):
    """The lines "# name = value" as a dictionary, and the rows with numbers where there are."""
    facts, table = {}, []
    with open(path, encoding="utf-8") as file:
        for line in file:
            if line.startswith("# "):
                name, _, value = line[2:].rstrip("\n").partition(" = ")
                if name in ("with", "left_out"):
                    facts.setdefault(name, []).append(value)
                else:
                    facts[name] = value
            else:
                table.append(line)
    return facts, numbers(csv.DictReader(table))


def read_beside(path, name):
    """The rows of another table in the folder of `path`; none if it is not there."""
    path = os.path.join(os.path.dirname(path), name)
    if not os.path.exists(path):
        return []
    with open(path, encoding="utf-8") as file:
        return numbers(csv.DictReader(file))


def numbers(rows):
    rows = list(rows)
    for row in rows:
        for name, value in row.items():
            if name not in WORDS:
                row[name] = float(value) if value else math.nan
    return rows


def has(rows, column):
    return any(math.isfinite(row.get(column, math.nan)) for row in rows)


def methods_of(rows):
    """Each method with its style, in the order of the data."""
    names = list(dict.fromkeys(row["method"] for row in rows))
    return {name: {"color": COLOURS[i % len(COLOURS)],
                   "linestyle": DASHES[i // len(COLOURS) % len(DASHES)]}
            for i, name in enumerate(names)}


def positive(xs, ys):
    """The points that a logarithmic chart can show."""
    return [(x, y) for x, y in zip(xs, ys) if x > 0 and y > 0 and math.isfinite(x + y)]


def merged(ends):
    """Ends (at, text, colour) in axes coordinates; those that nobody could tell apart share a label."""
    groups = []
    for at, text, colour in ends:
        near = [group for group in groups
                if abs(group[0][0] - at[0]) < 0.015 and abs(group[0][1] - at[1]) < 0.015]
        if near:
            near[0][1].append((text, colour))
        else:
            groups.append((at, [(text, colour)]))
    return groups


def label_ends(axes, ends):
    """Writes (x, y, text, colour) beside the axes, each at the height of the end of its curve, moved
    apart where labels would overlap, with a thin line to that end."""
    height = axes.get_window_extent().height
    step = 1.15 * plt.rcParams["font.size"] * axes.figure.dpi / 72 / height
    to_axes = axes.transData + axes.transAxes.inverted()
    groups = merged([(to_axes.transform((x, y)), text, colour) for x, y, text, colour in ends])
    # By height, and where that is about the same the farthest curve's label lowest: lines then cross
    # least.
    groups.sort(key=lambda group: (round(group[0][1] / 0.06), -group[0][0]))
    placed = [[at[1], at, lines] for at, lines in groups]
    for _ in range(2000):  # neighbours push each other apart
        moved = False
        for low, high in zip(placed, placed[1:]):
            gap = step * 0.5 * (len(low[2]) + len(high[2]))
            overlap = gap - (high[0] - low[0])
            if overlap > 1e-6:
                low[0] -= overlap / 2
                high[0] += overlap / 2
                moved = True
        if placed and placed[0][0] < 0:
            placed[0][0], moved = 0.0, True
        if not moved:
            break
    for y, at, lines in placed:
        for i, (text, colour) in enumerate(lines):
            axes.annotate(text, xy=(1.04, y + step * (0.5 * (len(lines) - 1) - i)),
                          xycoords="axes fraction", color=colour, va="center", fontsize="small",
                          annotation_clip=False, path_effects=HALO)
        axes.annotate("", xy=at, xytext=(1.035, y), xycoords="axes fraction", annotation_clip=False,
                      arrowprops={"arrowstyle": "-", "color": lines[0][1], "lw": 0.5, "alpha": 0.6,
                                  "shrinkA": 0, "shrinkB": 2})


def log_axes(axes):
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=9))
        axis.set_minor_formatter(NullFormatter())
    axes.tick_params(which="minor", length=2, color=PALE)
    axes.tick_params(which="major", length=4, color=PALE)


def solved(rows, facts, measure):
    """The row of a method's iterations that solves the step by a measure; None if none does."""
    if measure == "residual":  # a rule would have stopped there
        return next((row for row in rows if row["residual"] < float(facts["residual"])), None)
    first = None
    for row in reversed(rows):
        if not row["position_error"] <= float(facts["target"]):  # NaN is a failure too
            break
        first = row
    return first


def compare_panel(axes, rows, styles, abscissa, measure, facts):
    ends = []
    for method, style in styles.items():
        mine = [row for row in rows if row["method"] == method]
        points = positive([row[abscissa] for row in mine], [row[measure] for row in mine])
        if not points:
            continue
        axes.plot(*zip(*points), lw=1.4, solid_capstyle="round", **style)
        text = method
        if solved(mine, facts, measure) is None:
            axes.plot(*points[-1], marker="X", ms=8, color=style["color"], mec="white", mew=0.8,
                      zorder=5)
            text += f" ({mine[-1]['ended']})"
        ends.append((*points[-1], text, style["color"]))
    return ends


def name_curves(rows):
    """A curve is called after what it does not share with the others: scene, method or both. Returns
    the scenes."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    methods = {row["method"] for row in rows}
    for row in rows:
        if len(scenes) > 1:
            one = row["scene"] if len(methods) == 1 else f"{row['scene']}, {row['method']}"
            row["method"] = one.replace("_", " ")
    return scenes


def add_rates(axes):
    """Frames per second, where a frame is this one step."""
    above = axes.secondary_xaxis("top", functions=(inverse, inverse))
    above.set_xlabel("frames per second")
    above.tick_params(which="major", length=4, color=PALE)
    above.tick_params(which="minor", length=2, color=PALE)


def inverse(numbers):
    with np.errstate(divide="ignore"):
        return 1 / np.asarray(numbers, dtype=float)


ABSCISSAE = {"iteration": "iterations", "seconds": "seconds", "linear_iterations": "linear iterations"}


def draw_comparison(facts, rows, by_residual=False):
    scenes = dict.fromkeys(row["scene"] for row in rows)
    if len(scenes) > 1 and len(scenes) * len(methods_of(rows)) > MOST_CURVES:
        return draw_bars(facts, rows, by_residual)
    frames = sorted({row["frame"] for row in rows})
    scenes = name_curves(rows)
    styles = methods_of(rows)
    target = float(facts["residual" if by_residual else "target"])
    measures = [("residual", "characteristic norm")] if by_residual else [("position_error", "error of position")]
    # With contact there are no energies.
    if not by_residual and all(math.isfinite(row["energy_gap"]) for row in rows if row["iteration"] == 1):
        measures.append(("energy_gap", "energy above the solution"))
    count = len(measures)
    abscissae = [name for name in ABSCISSAE if name != "linear_iterations" or has(rows, name)]
    figure, grid = plt.subplots(count * len(frames), len(abscissae), squeeze=False,
                                figsize=(6 * len(abscissae), (4.1 * count + 0.5) * len(frames)))
    labels, rated = [], []
    for i, frame in enumerate(frames):
        mine = [row for row in rows if row["frame"] == frame]
        keys = [f"frame {frame:.0f} "]
        if f"frame {frame:.0f} length_m" not in facts:
            keys = [f"{scene} frame {frame:.0f} " for scene in scenes]
        scales = [1e3 * float(facts[key + "length_m"]) for key in keys]
        resolved = max(float(facts[key + "reference_last_move"]) for key in keys)
        for j, (measure, title) in enumerate(measures):
            for k, abscissa in enumerate(abscissae):
                axes = grid[count * i + j][k]
                log_axes(axes)
                labels.append((axes, compare_panel(axes, mine, styles, abscissa, measure, facts)))
                if measure != "energy_gap":
                    axes.axhline(target, color=PALE, lw=0.8, ls=(0, (4, 3)), zorder=1)
                    axes.annotate(f"target {target:.3g}", (1, target), xycoords=("axes fraction", "data"),
                                  ha="right", va="bottom", fontsize="small", color=PALE)
                if measure == "position_error":
                    limits = axes.get_ylim()
                    axes.axhspan(limits[0] * 1e-9, resolved, color="#f0f0f0", zorder=0, lw=0)
                    axes.set_ylim(limits)
                axes.set_xlabel(ABSCISSAE[abscissa])
                if abscissa == "seconds" and j == 0:
                    rated.append(axes)
            unit = "1 = at the step's start"
            if measure == "position_error":
                ends = dict.fromkeys(f"{scale:.3g}" for scale in (min(scales), max(scales)))
                unit = f"1 = {' to '.join(ends)} mm"
            grid[count * i + j][0].set_ylabel(title if by_residual else f"{title}   ({unit})")
        missing = [f"{row['method']}: {row['ended']}" for row in mine if row["iteration"] == 0]
        subtitle = f"step {frame:.0f}"
        if len(keys) == 1 and keys[0] + "contacts" in facts:
            subtitle += f", {int(facts[keys[0] + 'contacts']):,} pairs in contact"
        if missing:
            subtitle += ";  no iteration at all: " + ", ".join(missing)
        grid[count * i][0].set_title(subtitle, loc="left", fontsize="medium", color="#666666")
    return figure, labels, rated


def draw_bars(facts, rows, by_residual):
    """Seconds that methods take to solve a step of each scene; a cross where they do not."""
    styles = methods_of(rows)
    groups = list(dict.fromkeys((row["scene"], row["frame"]) for row in rows))
    measure = "residual" if by_residual else "position_error"
    figure, axes = plt.subplots(figsize=(12, 1.8 + 0.17 * len(groups) * (len(styles) + 1.5)))
    axes.set_xscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())
    bars, failures, ticks = [], [], []
    for g, (scene, frame) in enumerate(groups):
        first = g * (len(styles) + 1.5)
        ticks.append(first + 0.5 * (len(styles) - 1))
        for m, method in enumerate(styles):
            mine = [row for row in rows
                    if (row["scene"], row["frame"], row["method"]) == (scene, frame, method)]
            if not mine:
                continue
            at = solved(mine, facts, measure)
            if at is not None and at["seconds"] > 0:
                bars.append((first + m, at, method))
            else:
                failures.append((first + m, mine[-1], method))
    least = 0.5 * min((at["seconds"] for _, at, _ in bars), default=1)
    for y, at, method in bars:
        axes.barh(y, at["seconds"] - least, left=least, height=0.8, lw=0, color=styles[method]["color"],
                  alpha=1 if styles[method]["linestyle"] == "solid" else 0.55)
        axes.annotate(f"{method}   {at['iteration']:.0f} iterations", (at["seconds"], y), xytext=(5, 0),
                      textcoords="offset points", va="center", fontsize=7, annotation_clip=False)
    for y, end, method in failures:
        axes.plot(least, y, marker="X", ms=7, color=styles[method]["color"], mec="white", mew=0.8,
                  clip_on=False, zorder=5)
        at = end[measure]
        text = f"{method}   not solved: {end['ended']} at {at:.1e}" if math.isfinite(at) else \
            f"{method}   not solved: {end['ended']}"
        axes.annotate(text, (least, y), xytext=(8, 0), textcoords="offset points", va="center",
                      fontsize=7, annotation_clip=False)
    axes.set_xlim(left=least)
    axes.set_ylim(-1, len(groups) * (len(styles) + 1.5) - 1.5)
    axes.set_yticks(ticks, [f"{scene}, step {frame:.0f}" for scene, frame in groups])
    axes.invert_yaxis()
    axes.grid(axis="y", visible=False)
    goal = f"a characteristic norm of {float(facts['residual']):.3g}" if by_residual else \
        f"an error of {float(facts['target']):.3g}"
    axes.set_xlabel(f"seconds to {goal}")
    return figure, [], []


def draw_sweep(facts, rows, by_residual=False):
    styles = methods_of(rows)
    goal = f"a characteristic norm of {float(facts['residual']):.3g}" if by_residual else \
        f"an error of {float(facts['target']):.3g}"
    figure, grid = plt.subplots(1, 2, figsize=(12, 4.8))
    labels = []
    for axes, title in zip(grid, ("iterations", "seconds")):
        measure = f"residual_{title}" if by_residual else title
        log_axes(axes)
        ends, failures = [], []
        for method, style in styles.items():
            mine = [row for row in rows if row["method"] == method]
            points = positive([row["value"] for row in mine], [row[measure] for row in mine])
            if points:
                axes.plot(*zip(*points), marker="o", ms=4, lw=1.4, **style)
                ends.append((*points[-1], method, style["color"]))
            failures += [(row["value"], row["ended"], style["color"], method) for row in mine
                         if not row[measure] > 0]
        draw_failures(axes, failures)
        low, high = axes.get_ylim()
        if high < 10 * low:  # too little for powers of ten
            axes.yaxis.set_major_formatter(ScalarFormatter())
            axes.yaxis.set_minor_formatter(ScalarFormatter())
        axes.set_xlabel(facts["key"])
        axes.set_ylabel(f"{title} to {goal}")
        labels.append((axes, ends))
    return figure, labels, []


def draw_failures(axes, failures):
    """Crosses in a band above all curves, one line per method."""
    if not failures:
        return
    low, high = axes.get_ylim()
    methods = list(dict.fromkeys(failure[3] for failure in failures))
    step = (high / low) ** 0.07
    for value, reason, colour, method in failures:
        y = high * step ** (methods.index(method) + 0.7)
        axes.plot(value, y, marker="X", ms=8, color=colour, mec="white", mew=0.8, zorder=5)
    for i, method in enumerate(methods):
        mine = [failure for failure in failures if failure[3] == method]
        reasons = "/".join(dict.fromkeys(failure[1] for failure in mine))
        first = min(failure[0] for failure in mine)
        axes.annotate(f"{method}: {reasons}", (first, high * step ** (i + 0.7)), xytext=(-7, 0),
                      textcoords="offset points", ha="right", va="center", fontsize="small",
                      color=mine[0][2])
    axes.axhspan(high, high * step ** (len(methods) + 0.4), color="#f5f5f5", zorder=0, lw=0)
    axes.set_ylim(low, high * step ** (len(methods) + 0.4))


ENDINGS = {"end of scene": "#009E73", "out of time": "#999999", "intersects": "#D55E00",
           "inverts": "#CC79A7", "not converged": "#E69F00", "no step": "#000000"}


def draw_stability(facts, rows):
    turns = float(facts["end_of_scene_turns"])
    measure, end = ("turns", turns) if turns > 0 else ("seconds_simulated", float(facts["end_of_scene_s"]))
    figure, axes = plt.subplots(figsize=(12, 1.6 + 0.34 * len(rows)))
    inverted = []
    for y, row in enumerate(rows):
        colour = ENDINGS[row["ended"]]
        axes.barh(y, row[measure], height=0.62, color=colour, alpha=0.85, lw=0)
        if row["ended"] in ("end of scene", "out of time"):
            marker = {"marker": ">", "ms": 7}
        else:
            marker = {"marker": "X", "ms": 9}
        axes.plot(row[measure], y, color=colour, mec="white", mew=0.8, clip_on=False, zorder=5, **marker)
        if row["inverted_" + measure.split("_")[0]] > 0:
            inverted.append((row["inverted_" + measure.split("_")[0]], y))
        text = row["ended"]
        if row["ended"] == "end of scene":
            text = "clean to the end"
        elif row["why"] and row["ended"] != "no step":
            text += f": {row['why']}"
        rate = f"{row['iterations']:.0f} iterations per step" if row["steps"] > 0 else "no clean step"
        axes.annotate(f"{text}   ({rate})", (row[measure], y), xytext=(9, 0), va="center",
                      textcoords="offset points", fontsize="small", annotation_clip=False,
                      path_effects=HALO)
    if inverted:
        axes.plot(*zip(*inverted), ls="none", marker="|", ms=13, mew=1.6, color=INK, zorder=4,
                  label="elements are inverted from here on")
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), frameon=False, fontsize="small")
    axes.set_yticks(range(len(rows)), [row["policy"] for row in rows])
    axes.invert_yaxis()
    axes.set_xlim(0, end)
    axes.grid(axis="y", visible=False)
    axes.axvline(end, color=PALE, lw=0.8, ls=(0, (4, 3)), zorder=1)
    axes.set_xlabel("turns of the pin that turns most, up to the last clean step" if turns > 0
                    else "seconds simulated, up to the last clean step")
    return figure, [], []


def draw_relative(facts, rows, costs):
    """Bars per scene: the seconds of each method over those of one of them, in all and in the frame
    where they are the most. Of frames that both have come to."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    styles = methods_of(rows)
    unit = facts["relative_to"]
    figure, grid = plt.subplots(len(scenes), 2, squeeze=False,
                                figsize=(12, 1.7 + sum(0.5 + 0.3 * len(styles) for _ in scenes)))
    seconds = {}
    for cost in costs:
        seconds.setdefault((cost["scene"], cost["method"]), []).append(cost["seconds"])
    for pair, scene in zip(grid, scenes):
        mine = [row for row in rows if row["scene"] == scene]
        of_unit = seconds.get((scene, unit), [])
        for y, row in enumerate(mine):
            own = seconds.get((scene, row["method"]), [])[:len(of_unit)]
            done = row["ended"] == "end of scene"
            text = f"   error {1e3 * row['error_m']:.2g} mm" if math.isfinite(row["error_m"]) else ""
            if not done:
                text += f"   {row['ended']}, {row['frames']:.0f} of {row['of_frames']:.0f} frames"
            ratios = (1, 1)
            if own:
                ratios = (sum(own) / sum(of_unit[:len(own)]), max(a / b for a, b in zip(own, of_unit)))
            for axes, ratio, more in zip(pair, ratios, (text, "")):
                axes.barh(y, ratio, left=0, height=0.62, color=styles[row["method"]]["color"],
                          alpha=0.85 if done else 0.3, lw=0)
                axes.annotate((f"{ratio:.2f}" if own else "") + more, (ratio, y), xytext=(6, 0), va="center",
                              textcoords="offset points", fontsize="small", annotation_clip=False,
                              path_effects=HALO)
        for axes in pair:
            axes.set_xscale("log")  # bars from a sixth of the least
            axes.xaxis.set_minor_formatter(NullFormatter())
            widths = [bar.get_width() for bar in axes.patches]
            axes.set_xlim(min(widths) / 6, 2 * max(widths))
            axes.axvline(1, color=PALE, lw=0.8, ls=(0, (4, 3)), zorder=1)
            axes.set_yticks(range(len(mine)), [row["method"] for row in mine])
            axes.invert_yaxis()
            axes.grid(axis="y", visible=False)
        pair[1].set_yticklabels([])
        pair[0].set_title(scene, loc="left", fontsize="medium", color="#666666")
    grid[-1, 0].set_xlabel(f"seconds over those of {unit}")
    grid[-1, 1].set_xlabel("the same in a frame, at most")
    return figure, [], []


def draw_frames(facts, costs):
    """Seconds and iterations of every frame; linear iterations where there are any."""
    scenes = list(dict.fromkeys(row["scene"] for row in costs))
    styles = methods_of(costs)
    count = "linear_iterations" if any(row["linear_iterations"] > 0 for row in costs) else "iterations"
    figure, grid = plt.subplots(len(scenes), 2, squeeze=False, figsize=(12, 0.9 + 3.2 * len(scenes)))
    labels = []
    for pair, scene in zip(grid, scenes):
        for axes, measure in zip(pair, (count, "seconds")):
            axes.set_yscale("log")
            ends = []
            for method, style in styles.items():
                mine = [row for row in costs if (row["scene"], row["method"]) == (scene, method)]
                points = positive([row["frame"] for row in mine], [row[measure] for row in mine])
                if points:
                    axes.plot(*zip(*points), lw=1.2, **style)
                    ends.append((*points[-1], method, style["color"]))
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
            axes.set_xlabel("frame")
            axes.set_ylabel(f"{measure.replace('_', ' ')} of a frame")
            labels.append((axes, ends))
        pair[0].set_title(scene, loc="left", fontsize="medium", color="#666666")
    return figure, labels, []


def draw_fields(facts, rows, measure):
    """A row of pictures per method: points seen along z, the largest value in front."""
    curves = list(dict.fromkeys((row["scene"], row["frame"], row["method"]) for row in rows))
    iterations = sorted({row["iteration"] for row in rows})
    values = [row[measure] for row in rows if row[measure] > 0]
    high = max(values)
    low = max(min(values), 1e-7 * high)
    norm = matplotlib.colors.LogNorm(low, high)
    figure, grid = plt.subplots(len(curves), len(iterations), squeeze=False,
                                figsize=(12, 0.9 + 10.2 / max(len(iterations), 3) * len(curves)))
    for line, curve in zip(grid, curves):
        for axes, iteration in zip(line, iterations):
            mine = [row for row in rows if (row["scene"], row["frame"], row["method"]) == curve
                    and row["iteration"] == iteration and math.isfinite(row[measure])]
            mine.sort(key=lambda row: row[measure])
            spread = max(np.ptp([row["x"] for row in mine]), np.ptp([row["y"] for row in mine]))
            places = len({(round(row["x"] / spread, 4), round(row["y"] / spread, 4)) for row in mine})
            size = (0.9 * 72 * 9 / max(len(iterations), 3)) ** 2 / places
            drawn = axes.scatter([row["x"] for row in mine], [row["y"] for row in mine], s=size,
                                 c=[max(row[measure], low) for row in mine], norm=norm, marker="s",
                                 cmap="turbo", lw=0)
            axes.set_aspect("equal")
            axes.set_xticks([])
            axes.set_yticks([])
            for side in axes.spines.values():
                side.set_visible(False)
            axes.set_title(f"{curve[2]}, " + (f"after {iteration:.0f}" if iteration > 0 else "start"),
                           fontsize="small", loc="left")
    bar = figure.colorbar(drawn, cax=figure.add_axes([0.89, 0.2, 0.012, 0.6]))
    bar.set_label("residual over the characteristic force" if measure == "residual" else "error")
    return figure, [], []


def draw_matrices(facts, rows, patterns):
    """The pattern of every level, and nonzeros per row over the levels."""
    kinds = list(dict.fromkeys(row["hierarchy"] for row in rows))
    levels = sorted({row["level"] for row in rows})
    figure, grid = plt.subplots(len(kinds), len(levels), squeeze=False, figsize=(12, 1.4 + 2.6 * len(kinds)))
    for line, kind in zip(grid, kinds):
        for axes, level in zip(line, levels):
            mine = [row for row in patterns if (row["hierarchy"], row["level"]) == (kind, level)]
            about = [row for row in rows if (row["hierarchy"], row["level"]) == (kind, level)]
            if not about:  # levels made of the particles begin below the fine one
                axes.axis("off")
                continue
            bins = int(mine[0]["bins"])
            image = np.zeros((bins, bins))
            for row in mine:
                image[int(row["row"]), int(row["column"])] = row["blocks"]
            axes.imshow(image > 0, cmap="Greys", interpolation="nearest")
            axes.set_xticks([])
            axes.set_yticks([])
            axes.grid(False)
            axes.set_title(f"{'P' + chr(39) + 'AP' if kind == 'Galerkin' else 'of particles'}, level {level:.0f}",
                           fontsize="small", loc="left")
            axes.set_xlabel(f"{about[0]['nodes']:,.0f} nodes\n{about[0]['nonzeros']:.3g} nonzeros\n"
                            f"{about[0]['per_row']:.0f} per row", fontsize="small")
    return figure, [], []


def draw_totals(facts, rows):
    """Bars per scene: the seconds of each method, with its error; what did not come to the end is pale."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    styles = methods_of(rows)
    figure, grid = plt.subplots(len(scenes), 1, squeeze=False,
                                figsize=(12, 1.7 + sum(0.5 + 0.32 * len(styles) for _ in scenes)))
    for axes, scene in zip(grid[:, 0], scenes):
        mine = [row for row in rows if row["scene"] == scene]
        for y, row in enumerate(mine):
            done = row["ended"] == "end of scene"
            axes.barh(y, row["seconds"], height=0.62, color=styles[row["method"]]["color"],
                      alpha=0.85 if done else 0.3, lw=0)
            text = f"{row['iterations'] / max(row['frames'], 1):.0f} iterations a frame"
            if row["linear_iterations"] > 0:
                text += f", {row['linear_iterations'] / max(row['frames'], 1):.0f} linear"
            if math.isfinite(row["error_m"]):
                text += f", error {1e3 * row['error_m']:.2g} mm"
            if not done:
                text = f"{row['ended']}, {row['frames']:.0f} of {row['of_frames']:.0f} frames; " + text
            axes.annotate(text, (row["seconds"], y), xytext=(6, 0), va="center",
                          textcoords="offset points", fontsize="small", annotation_clip=False,
                          path_effects=HALO)
        axes.set_yticks(range(len(mine)), [row["method"] for row in mine])
        axes.invert_yaxis()
        axes.set_title(scene, loc="left", fontsize="medium", color="#666666")
        axes.grid(axis="y", visible=False)
    grid[-1, 0].set_xlabel("seconds of the whole scene")
    return figure, [], []


def describe(facts, by_residual):
    text = f"{facts['integrator']}, "
    if "with" not in facts:  # scenes have these of their own
        size = next(name for name in ("tets", "particles") if name in facts)
        text = (f"{int(facts[size]):,} {size}, {facts['materials']}, {facts['integrator']} with "
                f"{facts['step_s']} s, ")
    text += f"{facts['threads']} thread{'' if facts['threads'] == '1' else 's'}.  "
    if facts["kind"] == "stability":
        return text + "Clean: converged and without an intersection, after every step"
    if facts["kind"] == "totals":
        return text + "Errors at the end against a thousandth of the tolerance"
    if facts["kind"] == "matrices":
        return text + "Scalars that may be other than zero, nodes in the order of their coordinates"
    if by_residual:
        return text + "What is left of the force at each node, over a characteristic one (curves: rms)"
    text += "Errors against projected Newton in fp64"
    if facts["length"] == "motion":
        text += ", in units of the motion in the step"
        if facts["kind"] == "sweep":
            text += " at the first value"
    return text


def write(out, facts, rows, drawn, by_residual=False):
    """Lays a figure out, and writes OUT.svg and OUT.png."""
    facts = dict(facts)
    figure, labels, rated = drawn
    width, inches = figure.get_size_inches()
    panels = len(labels) > 0
    figure.subplots_adjust(left=0.065 * 12 / width, right=1 - 0.14 * 12 / width, wspace=0.5, hspace=0.24,
                           bottom=0.55 / inches, top=1 - 0.95 / inches)
    longest = max((len(row.get("method", "")) for row in rows), default=0)
    if panels and longest > 22:  # room for their names
        figure.set_size_inches(width + 0.13 * (longest - 22), inches)
        figure.subplots_adjust(right=1 - 0.18 * 12 / width, wspace=0.65)
    if rated:
        figure.subplots_adjust(hspace=0.3, top=1 - 1.15 / inches)
    if not panels:
        figure.subplots_adjust(left=0.22, right=0.7)
    if facts["kind"] == "totals" and panels:
        figure.subplots_adjust(hspace=0.4)
    if facts["kind"] == "totals" and "relative_to" in facts and not panels:
        figure.subplots_adjust(left=0.16, right=0.86, wspace=0.45)
    if facts["kind"] == "matrices":
        figure.subplots_adjust(left=0.02, right=0.98, wspace=0.15, hspace=0.5, bottom=0.75 / inches)
    if facts["kind"] == "comparison" and len(figure.axes) > 1 and not panels:  # fields
        figure.subplots_adjust(left=0.02, right=0.88, wspace=0.06, hspace=0.14, bottom=0.1 / inches)
    for name in facts.keys() - {"with", "left_out"}:
        facts[name] = re.sub(r"e\+0?", "e", facts[name])
    title = ", ".join([facts["scene"], *facts.get("with", [])])
    figure.text(0.02, 1 - 0.12 / inches, title, va="top", fontsize=13, fontweight="bold")
    if facts["kind"] == "sweep":  # what is swept is on the axis
        models = re.sub(r" \(.*?\)", "", facts["materials"]).split(", ")
        facts["materials"] = ", ".join(dict.fromkeys(models))
        facts["integrator"] = f"step {facts['frame']} of {facts['integrator']}"
    below_title = describe(facts, by_residual)
    if len(below_title) > 165:
        below_title = below_title.replace(".  ", ".\n", 1)
    figure.text(0.02, 1 - 0.40 / inches, below_title, va="top", color="#666666")
    left_out = "\n".join(f"left out: {scene}" for scene in facts.get("left_out", []))
    figure.text(0.02, 0.06 / inches, left_out, va="bottom", fontsize="small", color="#666666")
    for axes in rated:
        add_rates(axes)
    figure.canvas.draw()  # fixes the limits that labels are placed by
    for axes, ends in labels:
        label_ends(axes, ends)
    figure.savefig(out + ".svg")
    figure.savefig(out + ".png", dpi=140 if panels else 130)
    plt.close(figure)


def main():
    data, out = sys.argv[1:3]
    facts, rows = read(data)
    kind = facts["kind"]
    beside = os.path.join(os.path.dirname(out), "")
    for name in ("residual", "frames", "fields", "fields_residual"):  # of the chart that was there
        for ending in (".svg", ".png"):
            if os.path.exists(beside + name + ending):
                os.remove(beside + name + ending)
    costs, fields, patterns = (read_beside(data, name + ".csv") for name in ("frames", "fields", "patterns"))
    if kind == "stability":
        write(out, facts, rows, draw_stability(facts, rows))
    elif kind == "matrices":
        write(out, facts, rows, draw_matrices(facts, rows, patterns))
    elif kind == "totals":
        relative = "relative_to" in facts
        write(out, facts, rows, draw_relative(facts, rows, costs) if relative else draw_totals(facts, rows))
        if any(row["frame"] > 1 for row in costs):
            write(beside + "frames", facts, rows, draw_frames(facts, costs))
    else:
        draw = draw_sweep if kind == "sweep" else draw_comparison
        for name, by_residual in ((out, False), (beside + "residual", True)):
            if not by_residual or has(rows, "residual"):
                own = [dict(row) for row in rows]  # drawing names its curves
                write(name, facts, own, draw(facts, own, by_residual), by_residual)
        for measure, name in (("error", "fields"), ("residual", "fields_residual")):
            if has(fields, measure):
                write(beside + name, facts, rows, draw_fields(facts, fields, measure), measure == "residual")


if __name__ == "__main__":
    main()
