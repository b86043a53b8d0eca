"""Lee and Kim's appendix, line by line in NumPy, one vertex at a time: the slow twin of a filter.

Where the printed text cannot be meant or leaves a choice, the resolution stands beside the line.
"""

import numpy as np


def compute_diffuse(level, light, transfer):
    """Algorithm 2."""
    level_diffuse = np.zeros(3)
    for i in range(level**2, (level + 1) ** 2):
        level_diffuse += light[:, i] * transfer[i]
    return level_diffuse


def compute_specular(level, matrix, kernel, transfer):
    """Algorithm 3. Ŷ(i, j) is L̂_ij; `kernel` is α^i Y^i(B(ω_o))."""
    level_specular = np.zeros(3)  # printed as levelDiffuse
    for i in range(level**2, (level + 1) ** 2):
        r = np.zeros(3)
        for j in range((level + 1) ** 2):
            r += matrix[:, i, j] * transfer[j]
        level_specular += r * kernel[i]
    for i in range(level**2):
        increment = np.zeros(3)  # the printed R(i) would count lower levels again
        for j in range(level**2, (level + 1) ** 2):
            increment += matrix[:, i, j] * transfer[j]
        level_specular += increment * kernel[i]
    return level_specular


def multi_level_filtering(compute, albedo, base_level, target, threshold, fallback):
    """Algorithm 1 for one vertex: (what is shown, degree that is shown, levels it stayed in).

    `fallback` is what a vertex shows that left: all that was added before the test, as printed
    ("level"), or only what was added while it stayed inside ("base").
    """
    base = sum(compute(level) for level in range(base_level + 1))
    diff, shown, reached, stayed = np.zeros(3), np.zeros(3), base_level, []
    for level in range(base_level + 1, target + 1):
        diff = diff + compute(level)
        inside = np.abs(albedo * diff).max() >= threshold  # printed as diff < T
        if inside or fallback == "level":
            shown, reached = diff, level
        if not inside:
            break
        stayed.append(level)
    return base + shown, reached, stayed


def refine_roi(region, neighbors, joins, rings):
    """§4.4 with a queue: outwards from the region, those that change join, ring by ring."""
    region, seen = set(region), set(region)
    queue = sorted(region)
    for _ in range(rings):
        fringe = sorted({n for v in queue for n in neighbors[v]} - seen)
        seen |= set(fringe)
        queue = [v for v in fringe if joins(v)]
        region |= set(queue)
    return region


def smooth_boundary(added, region, neighbors):
    """Figure 7: in breadth-first order, two rings around the region take their neighbors' mean."""
    added, inside = np.array(added), set(region)
    for _ in range(2):
        ring = sorted({n for v in inside for n in neighbors[v]} - inside)
        means = [np.mean([added[n] for n in set(neighbors[v]) - {v}], axis=0) for v in ring]
        for v, mean in zip(ring, means, strict=True):
            added[v] = mean
        inside |= set(ring)
    return added
