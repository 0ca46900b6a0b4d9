#!/usr/bin/env python3
"""Draws a chart of one's own from the records of `lumivox chart`, and reads a picture into an array.

    pip install matplotlib numpy OpenEXR
    lumivox chart bundled:cornell -o out
    examples/own_chart.py out/cornell.jsonl own.png [picture.exr]

Each line of a .jsonl file is one measurement: a point of the grid in one round. Times are medians of its frames (ms).
"""

import json
import statistics
import sys
from collections import defaultdict

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def indirect_ms(record):
    """Time of indirect light in a frame (ms)."""
    return next(total["gpu_ms"]["median"] for total in record["totals"] if total["name"] == "indirect")


def points(path):
    """Error and time of indirect light by technique: the median of a point's rounds."""
    rounds = defaultdict(list)
    with open(path, encoding="utf-8") as lines:
        for record in map(json.loads, lines):
            if record.get("failure") is None:
                rounds[record["key"]].append(record)
    by_technique = defaultdict(list)
    for records in rounds.values():
        first = records[0]
        time_ms = statistics.median(indirect_ms(record) for record in records)
        by_technique[first["technique"]].append((time_ms, first["error"]["rel_rmse"]))
    return by_technique


def picture(path):
    """Red, green and blue of an image as an array of height × width × 3, linear."""
    import numpy
    import OpenEXR

    channels = OpenEXR.File(path, separate_channels=True).channels()
    return numpy.stack([channels[name].pixels for name in "RGB"], axis=-1)


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    figure, axes = plt.subplots(figsize=(9, 5), layout="constrained")
    axes.set_prop_cycle(color=plt.get_cmap("tab20").colors)
    for technique, values in sorted(points(sys.argv[1]).items()):
        axes.loglog(*zip(*values), "o", label=technique)
    axes.set_xlabel("time of indirect light [ms]")
    axes.set_ylabel("rel_rmse of indirect light")
    figure.legend(loc="outside right upper")
    figure.savefig(sys.argv[2])
    if len(sys.argv) == 4:
        pixels = picture(sys.argv[3])
        print(f"{sys.argv[3]}: {pixels.shape[1]}×{pixels.shape[0]} px, mean {pixels.mean(axis=(0, 1))}")


if __name__ == "__main__":
    main()
